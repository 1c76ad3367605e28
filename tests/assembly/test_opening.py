"""By how much a group stays open: lengths that differ, against triangles that do not close."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

import mechdae as md
from tests.shared.strategies import bounded, scales


def gap_of(mechanism: md.Mechanism, coordinate: str, value: float) -> tuple[str, float]:
    """Return the joint and the gap that the refusal names."""
    with pytest.raises(md.AssemblyError) as caught:
        md.solve(mechanism, md.Sweep(md.Driver(coordinate, at=(value,))))
    found = re.search(r"joint (\S+) stays open by (\S+) (m|rad)", str(caught.value))
    assert found is not None, str(caught.value)
    assert found[3] == "m"
    return found[1], float(found[2])


def four_bar(angle: float, sizes, rod: bool = False) -> md.Mechanism:
    a, b, c, d = (float(size) for size in sizes)
    bodies = [
        md.Body("crank", {"O": (0, 0), "A": (a, 0)}),
        md.Body("coupler", {"A": (0, 0), "B": (b, 0)}),
        md.Body("rocker", {"D": (0, 0), "B": (c, 0)}),
    ]
    joints = [
        md.Revolute("O", "ground.O", "crank.O"),
        md.Revolute("A", "crank.A", "coupler.A"),
        md.Revolute("B", "coupler.B", "rocker.B"),
        md.Revolute("D", "ground.D", "rocker.D"),
    ]
    if rod:
        del bodies[1]
        joints[1:3] = [md.Distance("rod", "crank.A", "rocker.B", length=b)]
    ground = md.Ground({"O": (0, 0), "D": (d, 0)})
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch={"crank": angle})


@pytest.mark.parametrize("rod", [False, True])
@settings(bounded, max_examples=4)
@given(scale=scales)
def test_a_dyad_opens_by_what_its_links_lack(rod: bool, scale: float) -> None:
    draw = np.random.default_rng(5)
    seen = {"short": 0, "long": 0}
    while min(seen.values()) < 4:
        a, b, c, d = draw.uniform(0.1, 2, 4)
        angle = float(draw.uniform(0, 2 * np.pi))
        reach = abs(a * np.exp(1j * angle) - d)
        word = "short" if reach > b + c else "long"
        missing = reach - b - c if word == "short" else abs(b - c) - reach
        if missing < 0.02:
            continue
        seen[word] += 1
        mechanism = four_bar(angle, scale * np.array([a, b, c, d]), rod)
        joint, gap = gap_of(mechanism, "crank.angle", angle)
        assert joint == ("rod" if rod else "B")
        assert gap == pytest.approx(scale * missing, rel=1e-3)  # four digits are printed


def test_a_cylinder_that_is_too_short_says_by_how_much() -> None:
    """Pins 2 m apart, an arm of 0.5 m, 1 m of cylinder: 0.5 m are missing."""
    mechanism = md.Mechanism(
        ground=md.Ground({"K": (0, 0), "R": (2.0, 0)}),
        bodies=[
            md.Body("barrel", {"K": (0, 0)}),
            md.Body("piston", {"P": (0, 0)}),
            md.Body("arm", {"R": (0, 0), "P": (0.5, 0)}),
        ],
        joints=[
            md.Revolute("K", "ground.K", "barrel.K"),
            md.Prismatic("cylinder", "barrel.K", "piston.P"),
            md.Revolute("P", "arm.P", "piston.P"),
            md.Revolute("R", "ground.R", "arm.R"),
        ],
        sketch={"barrel": 0.2, "arm": 2.0},
    )
    for slide, missing in ((1.0, 0.5), (0.25, 1.25), (2.75, 0.25)):
        assert gap_of(mechanism, "cylinder.slide", slide) == ("cylinder", missing)


def test_a_rod_that_does_not_reach_its_guide() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (0, 1.5)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (0.4, 0)}),
            md.Body("rod", {"A": (0, 0), "C": (0.6, 0)}),
            md.Body("block", {"C": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "rod.A"),
            md.Revolute("C", "rod.C", "block.C"),
            md.Prismatic("guide", "ground.G", "block.C"),
        ],
        sketch={"crank": np.pi / 6},
    )
    joint, gap = gap_of(mechanism, "crank.angle", np.pi / 6)
    assert joint in ("C", "guide")
    assert gap == pytest.approx(1.5 - 0.2 - 0.6, rel=1e-3)


def test_poses_that_a_sweep_loses_are_not_measured(monkeypatch) -> None:
    """Whether they assemble anywhere is asked of many: by how much not would cost far more."""
    from mechdae.motion.assembly import least_gap

    measured = []

    def counted(*given):
        measured.append(given)
        return opening(*given)

    opening = least_gap.opening
    monkeypatch.setattr(least_gap, "opening", counted)
    mechanism = four_bar(0.5, (2.0, 2.5, 2.0, 3.0))
    mechanism = replace(mechanism, sketch={"crank": 0.5, "rocker": 1.3})
    turn = md.Sweep(md.Driver("crank.angle", at=tuple(np.linspace(0.5, np.pi, 40))))
    result = md.solve(mechanism, turn)
    assert "unassembled" in result.status
    assert not measured
    gap_of(four_bar(np.pi, (2.0, 2.5, 2.0, 3.0)), "crank.angle", np.pi)
    assert measured
