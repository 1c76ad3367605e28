"""Certificates of the plane beyond regular paths: superfluous equations, change points."""

from __future__ import annotations

import itertools
import json
import math
import random
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
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
    "folding": ("folding-slider-crank", "turn", (1.3, math.pi / 2, 1.571, 1.9)),
    "kite": ("kite", "turn", (-0.3, 0.0, 1e-3, 0.3)),
    "anti": ("change-point-parallelogram", "anti_turn", (2.9, math.pi, 3.142, 3.3)),
}
PROVED = {
    "beam": "3 change points, 13 poses, 4 superfluous equations that hold identically",
    "rod": "0 change points, 13 poses, 1 superfluous equations that hold identically",
    "rods": "1 mode, 3 of 4 complex poses miss 1 superfluous equations",
    **dict.fromkeys(("folding", "kite", "anti"), "4 poses, 1 change points"),
}
"""Two circles meet in two points, two cranks more follow from a circle and a line each: of these 4
poses only the parallelogram closes with the third crank."""


@pytest.fixture(scope="module")
def written() -> dict[str, dict[str, Any]]:
    found = {}
    for word, (name, task, poses) in CASES.items():
        problem = md.load(name)
        if poses:
            own = problem.tasks[task]
            at = {"driver": md.Driver("crank.angle", at=poses)} if isinstance(poses, tuple) else {}
            changes = at | {"poses": None if at else poses}
            problem = problem.with_task(task, replace(own, **changes))
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
    cases = [*itertools.product(("rod", "rods", "folding"), (*KINDS, "number", "number"))]
    for word, kind in [*cases, ("beam", "number"), ("kite", "number"), ("anti", "bound")]:
        other, what = alter(written[word], kind, rng)
        if what:
            refusal(other, tmp_path / "c.json")
            count += 1
    assert count > 28


@pytest.fixture
def altered(written: Any, tmp_path: Path) -> Callable[..., str]:
    """What refuses a certificate whose entry at some keys is another one."""

    def refused(word: str, *keys: Any, to: Any) -> str:
        own = json.loads(json.dumps(written[word]))
        entry = own
        for key in keys[:-1]:
            entry = entry[key]
        entry[keys[-1]] = to
        return refusal(own, tmp_path / "c.json")

    return refused


def test_places_of_refusals(written: Any, altered: Callable[..., str]) -> None:
    """The motion, a pose, the complex poses, the end of the path; another problem's mechanism."""
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


def crossing(content: Any) -> int:
    """Return the number of the step that leads across a change point."""
    return next(k for k, step in enumerate(content["path"]["steps"]) if "through" in step)


def test_change_points_have_to_be_exact(written: Any, altered: Callable[..., str]) -> None:
    """A place, an angle, the driver, the mechanism off by little; a pose that is a regular one."""
    own = written["folding"]
    at = ("path", "steps", crossing(own), "through")
    place = f"path/steps/{at[2]}/through"
    for key, to in (("rod", ["0", "1", "-3"]), ("rod", ["1/1000000000000000000000", "1", "-1"])):
        assert "do not vanish exactly" in altered("folding", *at, "bodies", key, to=to)
    assert "right angle" in altered("folding", *at, "bodies", "rod", 2, to="-1000001/1000000")
    assert place in altered("folding", *at, "at", to="2")
    assert "not proved" in altered("folding", *at, "bodies", "rod", to=["0", "1", "3"])
    longer = "1000000000000000000001/1000000000000000000000"
    assert place in altered("folding", "mechanism", "bodies", "rod", "C", 0, to=longer)
    regular = {"crank": ["0", "0", "0"], "rod": ["1", "0", "0"], "slider": ["2", "0", "0"]}
    assert "rank 9 of 9" in altered("folding", *at, to={"at": "0", "bodies": regular})
    assert f"path/steps/{at[2]}" in altered("folding", *at[:3], "through", to=None)
    assert place in altered("folding", *at, to={"at": "1"})


def test_the_other_branch_behind_a_change_point_is_refused(
    written: Any, altered: Callable[..., str]
) -> None:
    """The rod that lies on the crank from there on, the slider that rests on the pivot."""
    own, k = written["folding"], crossing(written["folding"])
    angle = float(Fraction(own["path"]["steps"][k]["to"]))
    assert angle > math.pi / 2
    values = {
        "crank": (0.0, 0.0, angle),
        "rod": (math.cos(angle), math.sin(angle), angle - math.pi),
        "slider": (0.0, 0.0, 0.0),
    }
    bodies = {body: [str(Fraction(v)) for v in place] for body, place in values.items()}
    assert f"path/steps/{k}/bodies" in altered("folding", "path", "steps", k, "bodies", to=bodies)
    straight = [str(Fraction(v)) for v in (2 * math.cos(1.9), 0.0)]
    assert own["poses"][3]["points"]["slider.C"][1] == "0"
    assert abs(Fraction(own["poses"][3]["points"]["slider.C"][0]) - Fraction(straight[0])) < 1e-12
    assert "poses/3" in altered("folding", "poses", 3, "points", "slider.C", to=["0", "0"])


def test_change_points_that_are_not_exact_or_left_are_refused() -> None:
    """A rod that is longer by its last place; a motion that turns off to the other branch."""
    problem = md.load("folding-slider-crank")
    turn = replace(
        problem.tasks["turn"], driver=md.Driver("crank.angle", at=(1.3, 1.9)), poses=None
    )
    switch = problem.with_task("turn", replace(turn, on_change_point="switch"))
    with pytest.raises(UnavailableError, match="turns off"):
        md.certify(switch, "turn")
    longer = problem.with_task("turn", turn).with_values({"rod.C.x": np.nextafter(1.0, 2)})
    with pytest.raises(UnavailableError, match="not exact"):
        md.certify(longer, "turn")


def test_numbers_that_do_not_fit_have_no_closed_form() -> None:
    """A crank that is longer by its last place: poses meet all equations to rounding only."""
    problem = md.load("parallelogram-three-cranks")
    longer = problem.with_values({"rear.R.x": np.nextafter(0.3, 1)})
    for task in ("turn", "modes"):
        with pytest.raises(UnavailableError, match="do not meet them exactly"):
            md.certify(longer, task)
