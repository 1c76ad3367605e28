"""What all papers are: a document that is written as HTML or Typst, into a file or a notebook."""

from __future__ import annotations

from pathlib import Path

from mechdae.describe import whole_file
from mechdae.draw.formulas import Document
from mechdae.draw.formulas.writers import as_html, as_typst
from mechdae.records import dataclass


@dataclass(frozen=True)
class Paper:
    """A document."""

    document: Document

    def html(self) -> str:
        """Return it as one HTML file with its pictures in it, without scripts or requests."""
        return as_html(self.document)

    def typ(self) -> str:
        """Return it in the markup of Typst, with its pictures in it."""
        return as_typst(self.document)

    def _written(self, target: Path, form: str) -> Path:
        """Write it in one of its forms, whole or not at all, and return where it is."""
        content: str | bytes = getattr(self, form)()
        with whole_file(target) as file:
            file.write(content.encode() if isinstance(content, str) else content)
        return target

    def _repr_html_(self) -> str:
        return as_html(self.document, alone=False)
