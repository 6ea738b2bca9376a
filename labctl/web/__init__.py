"""The pages: files that a browser puts together, and asks the HTTP interface with, as anybody else does."""

from labctl.web.pages import install, is_page

__all__ = ["install", "is_page"]
