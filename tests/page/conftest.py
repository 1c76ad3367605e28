"""Chromium and a page opened in it, for the tests of this folder."""

from tests.shared.browser import browser, opened

__all__ = ["browser", "opened"]
