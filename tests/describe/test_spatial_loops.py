"""Spatial mechanisms written as closed vector loops: the same numbers, or refused by name."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file import library
from tests.shared.command import run
from tests.shared.loop_checks import again, check_same_in_space
from tests.shared.predefined import predefined

WRITTEN = {"rssr": 1, "rssp": 1, "wobble-plate": 1, "double-wishbone": 2, "five-rod-suspension": 4,
           "stewart-gough": 5, "delta-robot": 5, "hexapod": 5}  # fmt: skip
NO_SWEEP = {"rssp-path", "rssr-function", "rssr-path", "wishbone-poses"}
AXES = {
    "bennett": "Q (revolute)", "bevel-differential": "left_mesh (gear)", "bricard": "J1 (revolute)",
    "cardan-joint": "U (universal)", "double-cardan": "E (cylindrical)",
    "flyball-governor": "rise (prismatic)", "sarrus": "C2 (revolute)", "schatz": "J3 (revolute)",
    "screw-press": "thread (screw)", "seven-r": "J6 (revolute)", "six-axis-arm": "Z (prismatic)",
}  # fmt: skip
"""A joint that is named where loops are closed by axes."""


SLOW = pytest.mark.slow(reason="kernels of platforms and suspensions")


@pytest.mark.parametrize("name", [n if n in ("rssr", "rssp") else pytest.param(n, marks=SLOW)
                                  for n in WRITTEN])  # fmt: skip
def test_loops_in_space_have_the_numbers_of_the_bodies(name: str) -> None:
    problem = predefined(name)
    assert len(md.loops_of(problem).mechanism.closure.loops) == WRITTEN[name]
    check_same_in_space(
        problem, next(t for t, task in problem.tasks.items() if task.kind == "sweep")
    )


@pytest.mark.slow(reason="modes of a suspension by search")
def test_rods_across_the_border_of_the_azimuth_are_one_mode() -> None:
    """A rod whose azimuth is half a turn has it with either sign: the modes are eight, not nine."""
    problem = predefined("five-rod-suspension")
    modes = md.solve(again(md.loops_of(problem)), "modes")
    assert modes.summary["count"] == 8
    assert md.solve(problem, "modes").summary["count"] == 8


def why_not(problem: md.Problem) -> str:
    """Return why a problem is not written as loops, "" where it is."""
    try:
        md.loops_of(problem)
    except md.UnavailableError as error:
        return str(error).splitlines()[0]
    return ""


def test_every_spatial_problem_is_written_or_refused_by_name() -> None:
    whys = {name: why_not(predefined(name)) for name in library.names()
            if predefined(name).mechanism.dimension == 3
            and predefined(name).mechanism.closure is None}  # fmt: skip
    assert {name for name, why in whys.items() if not why} == {*WRITTEN, *NO_SWEEP}
    for name, joint in AXES.items():
        assert "closes points alone" in whys.pop(name)[:100]
        assert joint in why_not(predefined(name))
    rest = {name: why for name, why in whys.items() if why}
    assert list(rest) == ["flyball-governor-springs"]
    assert "an open chain is no closed vector loop" in rest["flyball-governor-springs"]


def random_rssr(rng: np.random.Generator) -> md.Problem:
    """Return a crank and a rocker about random axes, with a bar that is long enough."""
    axes = rng.normal(size=(2, 3))
    foot, crank, rocker = rng.uniform(0.2, 0.4, 3), *rng.uniform(0.05, 0.1, (2, 3))
    length = float(np.linalg.norm(foot + rocker - crank))
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": (0, 0, 0), "D": tuple(foot)}),
        bodies=[md.Body("crank", {"A": (0, 0, 0), "B": tuple(crank)}),
                md.Body("bar", {"B": (0, 0, 0), "C": (0, length, 0)}),
                md.Body("rocker", {"D": (0, 0, 0), "C": tuple(rocker)})],
        joints=[md.SpatialRevolute("A", "ground.A", "crank.A", axis=tuple(axes[0])),
                md.Spherical("B", "crank.B", "bar.B"), md.Spherical("C", "bar.C", "rocker.C"),
                md.SpatialRevolute("D", "ground.D", "rocker.D", axis=tuple(axes[1]))],
        sketch={"A": 0.0, "D": 0.0},
    )  # fmt: skip
    sweep = md.Sweep(driver=md.Driver("A.angle", from_=0.0, to=0.1, speed=1.0), poses=3)
    return md.Problem(mechanism, {"turn": sweep})


@SLOW
def test_random_spatial_mechanisms_as_loops() -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        check_same_in_space(random_rssr(rng), "turn")


def test_what_is_given_in_space_is_listed(capsys, tmp_path) -> None:
    file = tmp_path / "loops.toml"
    code, out, _ = run(capsys, "show", "rssp", "--loops", "--out", str(file))
    assert code == 0
    assert "bar: length 0.3 m, elevation unknown, azimuth unknown" in out
    azimuth, elevation = np.degrees([np.arctan2(1, 3), np.arctan2(1, np.hypot(3, 1))])
    assert f"G: length unknown, elevation {elevation:.6g} deg, azimuth {azimuth:.6g} deg" in out
    assert md.load(file).mechanism.closure is not None
    code, _, err = run(capsys, "show", "bennett", "--loops")
    assert code == 2
    assert "P (revolute), Q (revolute), R (revolute), S (revolute)" in err
