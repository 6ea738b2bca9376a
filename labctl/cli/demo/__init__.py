"""`labctl demo`: the whole job on simulated benches in virtual time, and on a real gyro's recording."""

from labctl.cli.demo.story import run_demo

__all__ = ["run_demo"]
