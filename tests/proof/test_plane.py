"""Certificates of the plane beyond regular paths: redundant equations, change points, curves."""

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
from mechdae.errors import UnavailableError
from tests.shared.altered import KINDS, alter
from tests.shared.certified import certificate, checked, refusal
from tests.shared.paths import ROOT

flint = pytest.importorskip("flint", reason="python-flint is not installed")
from mechdae.parts.proof.checker.arithmetic import ONE, Dual  # noqa: E402
from mechdae.parts.proof.checker.formulas import evaluate, parsed, repeats, slope  # noqa: E402
from mechdae.parts.proof.write import certificate_of  # noqa: E402

HALF_TURN = Fraction("3.14159265358979323846264338327950288419716939937510")
PROVED = {
    "beam": "3 change points, 4 redundant equations that hold identically, from",
    "rod": "0 change points, 1 redundant equations that hold identically",
    "rods": "1 mode, and no others: 3 of 4 complex poses, 2 by circles and lines times 2",
    **dict.fromkeys(("folding", "anti"), "1 change points, from"),
    **{"cam": "0 limit positions, from 0 to 0.1"},
    **{"contacts": "2 modes, and", "seals": "8 modes, and no others"},
}
"""Two circles meet in two points, two cranks more follow from a circle and a line each: of these 4
poses only the parallelogram closes with the third crank. A line through the middle of a curve that
goes round it once meets it twice: cam and lobes; three seals in front or behind."""


@pytest.mark.parametrize("word", PROVED)
def test_what_is_proved(word: str, tmp_path: Path) -> None:
    assert PROVED[word] in checked(certificate(word), tmp_path)


def test_altered_certificates_are_refused(tmp_path: Path) -> None:
    rng, count = random.Random(3), 0
    cases = [*itertools.product(("rod", "rods"), (*KINDS, "number", "number"))]
    cases += itertools.product(("contacts", "seals"), ("number", "number", *KINDS[1:9]))
    cases += [("folding", kind) for kind in ("number", "step", "order", "pose", "joint", "body")]
    cases += [("cam", kind) for kind in ("number", "step", "order", "pose", "law")]
    for word, kind in [*cases, ("beam", "number"), ("anti", "bound")]:
        other, what = alter(certificate(word), kind, rng)
        if what:
            refusal(other, tmp_path)
            count += 1
    assert count > 30


@pytest.fixture
def altered(tmp_path: Path) -> Callable[..., str]:
    """What refuses a certificate whose entry at some keys is another one."""

    def refused(word: str, *keys: Any, to: Any) -> str:
        content = certificate(word)
        entry = content
        for key in keys[:-1]:
            entry = entry[key]
        entry[keys[-1]] = to
        return refusal(content, tmp_path)

    return refused


def test_places_of_refusals(altered: Callable[..., str]) -> None:
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
    assert "path/steps/0" in altered("rod", "mechanism", to=certificate("beam")["mechanism"])
    assert "complex/1" in altered("rods", "complex", 1, to=certificate("rods")["complex"][0])
    assert "modes" in altered("rods", "modes", to=[])
    assert "modes/0" in altered("rods", "modes", 0, "angles", "rod", to="1/1000000000000")


def crossing(content: Any) -> int:
    """Return the number of the step that leads across a change point."""
    return next(k for k, step in enumerate(content["path"]["steps"]) if "through" in step)


def test_change_points_have_to_be_exact(altered: Callable[..., str]) -> None:
    """A place, an angle, the driver, the mechanism off by little; a pose that is a regular one."""
    own = certificate("folding")
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
    altered: Callable[..., str],
) -> None:
    """The rod that lies on the crank from there on, the slider that rests on the pivot."""
    own, k = certificate("folding"), crossing(certificate("folding"))
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


def test_tangents_of_rollers_have_the_sense_of_the_curve(tmp_path: Path) -> None:
    """The roller on the other side with the tangent turned round: all equations still hold."""
    content = certificate("contacts")
    joint = content["mechanism"]["joints"]["profile"]
    joint["roller"] = str(-Fraction(joint["roller"]))
    for mode in content["modes"]:
        place = mode["bodies"]["profile"]
        place[1] = str(Fraction(place[1]) + HALF_TURN)
    why = refusal(content, tmp_path)
    assert "modes/0" in why
    assert "against its curve" in why


def test_curves_that_are_none_are_refused(altered: Callable[..., str]) -> None:
    deep: Any = "s"
    for _ in range(600):
        deep = ["sin", deep]
    bad = (["tan", "s"], ["cos"], ["+", "s"], ["/", "1", "0"], "t", None, [], ["s"], deep, {"s": 1})
    for word in ("cam", "contacts"):
        for curve in bad:
            altered(word, "mechanism", "joints", "profile", "x", to=curve)
        keys = ("mechanism", "joints", "profile", "first")
        assert "joints/profile" in altered(word, *keys, to="cam.nowhere")


def test_periods_are_seen_in_formulas() -> None:
    """Only curves that repeat after a turn of s are counted all the way round."""

    def found(formula: Any) -> bool:
        return repeats(parsed(formula, "x"))

    half, twice = ["*", "1/2", "s"], ["*", ["+", "3", "-1"], "s"]
    for formula in (["cos", "s"], ["*", "2", ["sin", ["+", twice, "1/7"]]], ["sqrt", ["cos", "s"]]):
        assert found(formula)
    for formula in ("s", ["cos", half], ["+", "s", ["cos", "s"]], ["sin", ["cos", half]]):
        assert not found(formula)
    assert not found(["cos", ["*", "s", "s"]])


def test_slopes_of_formulas_are_right() -> None:
    """Against differences of fourth order."""
    texts = ["/", ["+", ["sin", ["*", "3", "s"]], "2"], ["sqrt", ["+", "5/4", ["*", "s", "s"]]]]
    formula = parsed(["*", ["cos", texts], ["+", "s", ["*", "0", "s"]]], "x")

    def value(of: Any, s: float) -> float:
        return float(evaluate(of, flint.arb(s), "x"))

    h = 1e-3
    for s in (-1.3, 0.2, 0.9, 2.4):
        near = [value(formula, s + k * h) for k in (-2, -1, 1, 2)]
        expected = (near[0] - 8 * near[1] + 8 * near[2] - near[3]) / (12 * h)
        assert value(slope(formula), s) == pytest.approx(expected, rel=1e-9, abs=1e-9)
        dual = evaluate(formula, Dual(flint.arb(s), {0: ONE}), "x")
        assert float(dual.d[0]) == pytest.approx(value(slope(formula), s), rel=1e-14)


def test_numbers_that_do_not_fit_have_no_closed_form() -> None:
    """A crank that is longer by its last place: poses meet all equations to rounding only."""
    problem = md.load("parallelogram-three-cranks")
    longer = problem.with_values({"rear.R.x": np.nextafter(0.3, 1)})
    for task in ("turn", "modes"):
        with pytest.raises(UnavailableError, match="do not meet them exactly"):
            md.certify(longer, task)


def test_page_tells_what_became_of_alterations() -> None:
    data = json.loads((ROOT / "docs" / "data" / "certificates.json").read_text())
    found = data["alterations_in_the_plane"]
    page = (ROOT / "docs" / "theory/evidence/certificates.md").read_text(encoding="utf-8")
    unseen = len(found["seen_beside_the_problem"])
    assert found["passed"] == []
    assert f"Of {found['count']} alterations planted in certificates of change points" in page
    assert (
        f"curves {found['count'] - unseen} are refused with their place; the other {unseen}" in page
    )


def test_laws_with_divisors_that_move_are_certified(tmp_path: Path) -> None:
    """A crank whose law is a quotient."""
    problem = md.load("differential")
    laws = problem.tasks["laws"]
    wheel, crank = laws.drivers
    quotient = replace(crank, law="0.3*sin(omega1*t)/(1.02 + sin(omega1*t))")
    problem = problem.with_task("laws", replace(laws, drivers=(wheel, quotient), poses=7))
    content = certificate_of(problem, "laws")
    assert "/" in str(content["mechanism"]["drivers"]["crank.angle"])
    law = content["mechanism"]["drivers"]["crank.angle"]
    assert "7 poses" in checked(content, tmp_path)
    content["mechanism"]["drivers"]["crank.angle"] = ["+", "1/1000000000", law]
    assert "path/bodies/crank" in refusal(content, tmp_path)
