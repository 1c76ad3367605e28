"""Certificates of the plane beyond regular paths: superfluous equations."""

from __future__ import annotations

import itertools
import json
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.errors import SolveError, UnavailableError
from tests.shared.altered import KINDS, alter

pytest.importorskip("flint", reason="python-flint is not installed")
CASES = {
    "beam": ("five-crank-parallelogram", "turn", 13),
    "rod": ("parallelogram-three-cranks", "turn", 13),
    "rods": ("parallelogram-three-cranks", "modes", None),
}
PROVED = {
    "beam": "3 change points, 13 poses, 4 superfluous equations that hold identically",
    "rod": "0 change points, 13 poses, 1 superfluous equations that hold identically",
    "rods": "1 mode, 3 of 4 complex poses miss 1 superfluous equations",
}
"""Two circles meet in two points, two cranks more follow from a circle and a line each: of these 4
poses only the parallelogram closes with the third crank."""


@pytest.fixture(scope="module")
def written() -> dict[str, dict[str, Any]]:
    found = {}
    for word, (name, task, poses) in CASES.items():
        problem = md.load(name)
        if poses:
            problem = problem.with_task(task, replace(problem.tasks[task], poses=poses))
        found[word] = md.certify(problem, task)
    return found


def refusal(content: Any, path: Path) -> str:
    """Return place and reason with which a certificate is refused."""
    path.write_text(json.dumps(content))
    with pytest.raises(SolveError, match="refused") as refused:
        md.check_certificate(path)
    assert refused.value.where
    return f"{refused.value.where} {refused.value}"


@pytest.mark.parametrize("word", CASES)
def test_what_is_proved(word: str, written: Any, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps(written[word]))
    assert PROVED[word] in md.check_certificate(path)


def test_altered_certificates_are_refused(written: Any, tmp_path: Path) -> None:
    rng, count = random.Random(3), 0
    for word, kind in itertools.product(CASES, (*KINDS, "number", "number")):
        other, what = alter(written[word], kind, rng)
        if what:
            refusal(other, tmp_path / "c.json")
            count += 1
    assert count > 24


def test_places_of_refusals(written: Any, tmp_path: Path) -> None:
    """The motion, a pose, the complex poses, the end of the path; another problem's mechanism."""

    def altered(word: str, *keys: Any, to: Any) -> str:
        own = json.loads(json.dumps(written[word]))
        entry = own
        for key in keys[:-1]:
            entry = entry[key]
        entry[keys[-1]] = to
        return refusal(own, tmp_path / "c.json")

    turned = [[["0", "16/5", "0"], ["1", "3/10", "0"]], [["1", "0", "3/10"]], ["1", "0"]]
    assert "mechanism/motion" in altered("rod", "mechanism", "motion", "rear", to=turned)
    assert "mechanism/motion/rear" in altered("rod", "mechanism", "motion", "rear", to=[[], []])
    assert "mechanism/superfluous" in altered("rod", "mechanism", "superfluous", to=["12"])
    assert "mechanism" in altered("rod", "mechanism", "superfluous", to=[])
    assert "path/to" in altered("beam", "path", "to", to="7")
    assert "the rank falls" in altered("beam", "path", "steps", 0, "change_point", to=False)
    assert "path/steps" in altered("beam", "path", "steps", 5, "change_point", to=True)
    assert "poses/3" in altered("beam", "poses", 3, "at", to="3")
    assert "path/steps/0" in altered("rod", "mechanism", to=written["beam"]["mechanism"])
    assert "complex/1" in altered("rods", "complex", 1, to=written["rods"]["complex"][0])
    assert "modes" in altered("rods", "modes", to=[])
    assert "modes/0" in altered("rods", "modes", 0, "angles", "rod", to="1/1000000000000")


def test_numbers_that_do_not_fit_have_no_closed_form() -> None:
    """A crank that is longer by its last place: poses meet all equations to rounding only."""
    problem = md.load("parallelogram-three-cranks")
    longer = problem.with_values({"rear.R.x": np.nextafter(0.3, 1)})
    for task in ("turn", "modes"):
        with pytest.raises(UnavailableError, match="do not meet them exactly"):
            md.certify(longer, task)
