"""The live page: one HTML file in which a mechanism is solved again in the browser."""

from __future__ import annotations

from mechdae.pages.document import Page, page

__all__ = ["Page", "page"]
