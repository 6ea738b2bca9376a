"""HTTP: translates requests into services and answers into JSON; decides nothing."""

from labctl.api.app import create_app

__all__ = ["create_app"]
