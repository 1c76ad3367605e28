"""The notebooks of the documentation: small files whose cells run from first to last."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.shared.paths import DOCS

NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))


def cells(kind: str, data: dict[str, Any]) -> list[str]:
    return ["".join(cell["source"]) for cell in data["cells"] if cell["cell_type"] == kind]


def test_there_are_six_with_a_title_and_no_outputs() -> None:
    assert len(NOTEBOOKS) == 6
    page = (DOCS / "tutorials/notebooks.md").read_text(encoding="utf-8")
    for path in NOTEBOOKS:
        data = json.loads(path.read_text(encoding="utf-8"))
        assert data["nbformat"] == 4
        assert cells("markdown", data)[0].startswith("# ")
        assert not any(cell.get("outputs") for cell in data["cells"])
        assert f"(../notebooks/{path.name})" in page


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_all_cells_run(path: Any) -> None:
    """In one namespace; what a cell says about its answer is asserted in it."""
    names: dict[str, Any] = {"__name__": "__main__"}
    for code in cells("code", json.loads(path.read_text(encoding="utf-8"))):
        exec(compile(code, path.name, "exec"), names)
    assert "md" in names
