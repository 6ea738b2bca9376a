"""Drivers of analog gyros on fast inputs."""
