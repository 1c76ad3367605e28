"""The live page: one HTML file in which a mechanism is solved again in the browser."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.additions import lazy_names

if TYPE_CHECKING:
    from mechdae.parts.page.document import Page, page

__all__ = ["Page", "page"]
__getattr__ = lazy_names({"mechdae.parts.page.document": "Page page"})
