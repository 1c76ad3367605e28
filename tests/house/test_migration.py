"""The page for users of other programs: their code runs, the numbers are the same."""

from __future__ import annotations

import contextlib
import io
import re
import tomllib

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared.paths import ROOT

TEXT = (ROOT / "docs/how-to/migration.md").read_text(encoding="utf-8")


def shown() -> list[list[float]]:
    """Return the numbers that the page has of pylinkage: place, speed, acceleration of P [mm]."""
    block = re.search(r"^```py\n.*?^```$\n\n```text\n(.*?)^```$", TEXT, re.S | re.M)
    assert block is not None
    return [[float(word) for word in line.split()] for line in block[1].splitlines()]


def test_the_file_has_the_numbers_of_pylinkage() -> None:
    block = re.search(r"^```toml\n(schema.*?)^```$", TEXT, re.S | re.M)
    assert block is not None
    result = md.solve(from_dict(tomllib.loads(block[1])), "turn")
    own = result.points["coupler.P"]
    rows = [30, 60, 90]
    ours = np.hstack([own.position[rows], own.velocity[rows], own.acceleration[rows]])
    assert 1e3 * ours == pytest.approx(np.array(shown()), abs=6e-7)


def test_the_code_of_pylinkage_prints_what_is_shown() -> None:
    pytest.importorskip("pylinkage", reason="pylinkage is not installed")
    block = re.search(r"^```py\n(.*?)^```$", TEXT, re.S | re.M)
    assert block is not None
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(block[1], "docs/how-to/migration.md", "exec"), {})
    printed = [[float(word) for word in line.split()] for line in out.getvalue().splitlines()]
    assert np.array(printed) == pytest.approx(np.array(shown()), abs=2e-6)
