"""Devices that speak lines of text: what is asked, how a reply reads, and their settings."""
