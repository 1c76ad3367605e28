"""Curve joints as they are described: their structure, files to and fro, what is refused."""

from __future__ import annotations

from dataclasses import replace

import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.writing import dumps
from mechdae.describe.values import Table
from mechdae.errors import MechanismError, MechdaeError
from mechdae.tasks.show import structure
from tests.shared.cams import PI
from tests.shared.mechanisms import cam


def test_structure_counts_one_higher_pair() -> None:
    problem = md.load("cam-roller-follower")
    shown = structure(problem)
    count = shown["mobility"]
    assert (count["n"], count["p5"], count["p4"], count["W"]) == (2, 2, 1, 1)
    assert count["rank"]["mobility"] == 1
    assert shown["formulas"][0]["formula"] == "I(1) -> II cam(2)"
    assert shown["groups"][1]["joints"] == ["guide", "profile"]
    # a follower that hangs on a cam driven by gears stays a group of its own
    drive = structure(md.load("hypocycloid-drive"))["formulas"][0]
    assert drive["formula"] == "I(1) -> II gear(2) -> {II.5 RPP(3,4); II cam(5)}"


def test_a_curve_is_written_and_read_back() -> None:
    for name in ("cam-roller-follower", "hypocycloid-drive"):
        problem = md.load(name)
        import tomllib

        again = from_dict(tomllib.loads(dumps(problem)), name)
        assert again.mechanism == problem.mechanism
    millimetres = from_dict(
        tomllib.loads(
            dumps(Problem(cam("60*cos(s)", "40*sin(s)", closed=True)))
            .replace('x = "60', 'x_mm = "60')
            .replace('y = "40', 'y_mm = "40')
        )
    )
    assert millimetres.mechanism.joints["profile"].x == "(60*cos(s))/1000"
    changed = millimetres.with_values({"profile.end_deg": 360})
    assert changed.mechanism.values()["profile.end"] == pytest.approx(2 * PI)


BAD = [
    ({"closed": False}, "joints.profile.range: the key 'range' is missing"),
    ({"x": "0.03", "y": "0.04"}, "joints.profile.x: neither x nor y depends on s"),
    ({"x": "0.03*cos(t)"}, "joints.profile.x: unknown name 't'"),
    ({"x": "radus*cos(s)"}, "joints.profile.x: unknown name 'radus'"),
    ({"range": (0, 6)}, "joints.profile.closed: the curve is not closed"),
    ({"range": (6, 0)}, "joints.profile.range: range ends at 0, not after its start 6"),
    ({"roller": -0.01}, "joints.profile.roller_radius: roller_radius is negative"),
    ({"x": "sqrt(cos(s))"}, "joints.profile.x: 'sqrt(cos(s))' has no value"),
    ({"x": "0.03/(s - 0)"}, "joints.profile.x: '0.03/(s - 0)' has no value"),
    ({"x": "0*s", "y": "0*s"}, "joints.profile.x: the curve is a single point"),
    ({"side": "inside"}, "side: unknown side 'inside'"),
    ({"x": "import os"}, "x: 'import os' is not an expression"),
]


@pytest.mark.parametrize(("keys", "message"), BAD)
def test_what_is_no_curve_is_refused(keys: dict, message: str) -> None:
    whole = {"x": "0.03*cos(s)", "y": "0.03*sin(s)", **keys}
    with pytest.raises(MechdaeError) as caught:
        cam(**whole)
    assert message in str(caught.value)


def test_a_parameter_may_not_be_called_like_that_of_the_curve() -> None:
    mechanism = cam("0.03*cos(s)", "0.03*sin(s)")
    with pytest.raises(MechanismError, match="is the parameter of the curve in joint profile"):
        replace(mechanism, parameters=Table({"s": 1.0}))
