"""The pages: static files for the browser, which uses the same HTTP API as every other client."""

from labctl.web.pages import install, is_page, prepare

__all__ = ["install", "is_page", "prepare"]
