"""Sketches whose driven slides do not close, and what messages say of where a group would."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.errors import AssemblyError, MechanismError
from tests.shared.booms import BOOM, boom, reach_missed, slide_missed


def solved(sketch: dict[str, float], **driver) -> md.Result:
    return md.solve(boom(sketch), md.Sweep(md.Driver("cyl.slide", **driver)))


@pytest.mark.parametrize("seed", range(8))
def test_a_driven_slide_may_be_sketched_out_of_reach(seed: int) -> None:
    assert slide_missed(seed) < 1


def test_the_sketched_angles_choose_the_mode_all_the_same() -> None:
    up = solved({"boom": 0.5, "cyl": 9.0}, at=[1.2]).bodies["boom"].angle[0]
    down = solved({"boom": -2.5, "cyl": 9.0}, at=[1.2]).bodies["boom"].angle[0]
    assert abs(up - down) > 1
    result = solved({"boom": 0.5, "cyl": 9.0}, at=[1.2])
    assert "begun at cyl.slide = 1.2 m, which is asked for" in " ".join(result.summary["notes"])


def test_a_sketch_that_closes_is_where_it_begins() -> None:
    assert "notes" not in solved({"boom": 0.5, "cyl": 1.3}, at=[1.2]).summary


def test_several_driven_slides() -> None:
    """Two booms on the ground, each with its cylinder: the angles are those of either alone."""
    one, mirror = boom({"boom": 0.5}), {"boom": "boom2", "barrel": "barrel2", "rod": "rod2"}
    bodies = [*one.bodies.values(), *(md.Body(mirror[n], b.points) for n, b in one.bodies.items())]
    joints = list(one.joints.values())
    for joint in one.joints.values():
        ends = [
            ".".join([mirror.get(part, part), point])
            for part, point in (end.split(".") for end in (joint.first, joint.second))
        ]
        joints.append(type(joint)(f"{joint.name}2", *ends))
    both = md.Mechanism(
        ground=one.ground, bodies=bodies, joints=joints,
        sketch={"boom": 0.5, "boom2": 0.5, "cyl": 9.0, "cyl2": 0.01},
    )  # fmt: skip
    drivers = (md.Driver("cyl.slide", at=[1.1, 1.2]), md.Driver("cyl2.slide", at=[1.3, 1.35]))
    result = md.solve(both, md.Sweep(drivers=drivers))
    assert set(result.status) == {"ok"}
    for name, slides in (("boom", (1.1, 1.2)), ("boom2", (1.3, 1.35))):
        assert result.bodies[name].angle == pytest.approx([BOOM(s) for s in slides], abs=1e-12)


@pytest.mark.parametrize(("sketched", "end"), [(2.5, "most"), (0.2, "least")])
def test_where_a_slide_closes(sketched: float, end: str) -> None:
    """Stretched or folded: the pin of the boom is at most |OB| + |OP| from the base."""
    with pytest.raises(AssemblyError) as caught:
        solved({"boom": 0.5, "cyl": sketched}, range="assembled")
    found = re.search(r"it closes from cyl.slide = (\S+) m (on|down)", str(caught.value))
    assert found is not None
    base, arm = math.hypot(0.3, 0.4), math.hypot(1.2, 0.3)
    wanted = arm + base if end == "most" else arm - base
    value = float(found[1])
    assert 0 < (wanted - value) * (1 if end == "most" else -1) < 1e-3
    assert found[2] == ("down" if end == "most" else "on")
    assert solved({"boom": 0.5, "cyl": value}, range="assembled").status[0] in ("ok", "limit")


def test_where_a_crank_closes() -> None:
    """A four-bar whose crank does not turn: |BD| = 3 + 1.5 at its limit, by the law of cosines."""
    bodies = [
        md.Body("crank", {"A": (0, 0), "B": (2, 0)}),
        md.Body("coupler", {"B": (0, 0), "C": (3, 0)}),
        md.Body("rocker", {"D": (0, 0), "C": (1.5, 0)}),
    ]
    ends = [("ground.A", "crank.A"), ("crank.B", "coupler.B"), ("coupler.C", "rocker.C"),
            ("ground.D", "rocker.D")]  # fmt: skip
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (4, 0)}),
        bodies=bodies,
        joints=[md.Revolute(name, *own) for name, own in zip("ABCD", ends, strict=True)],
        sketch={"crank": 1.7, "coupler": 0.0, "rocker": 1.0},
    )
    with pytest.raises(AssemblyError) as caught:
        md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=[1.0])))
    limit = math.degrees(math.acos((16 + 4 - 4.5**2) / 16))
    found = re.search(r"it closes from crank.angle = (\S+) deg down", str(caught.value))
    assert found is not None
    assert limit - 0.05 < float(found[1]) < limit
    apart = math.sqrt(16 + 4 - 16 * math.cos(1.7))
    least = re.search(
        r"here B to C of coupler at least (\S+) m, or D to C of rocker", str(caught.value)
    )
    assert least is not None
    assert float(least[1]) == pytest.approx(apart - 1.5, rel=1e-5)


@pytest.mark.parametrize("seed", range(6))
def test_lengths_that_would_reach(seed: int) -> None:
    assert reach_missed(seed) < 1


# -- points of one pin --------------------------------------------------------------------------


def three_on_a_pin(second: str, points: dict[str, tuple[float, float]]) -> md.Mechanism:
    """Return the links of `two-pins-on-one-spot`, the rod's joint at `second` of the rocker."""
    bodies = [
        md.Body("crank", {"A": (0, 0), "B": (1, 0)}),
        md.Body("coupler", {"B": (0, 0), "C": (3, 0)}),
        md.Body("rocker", {"D": (0, 0), "C": (2.5, 0), **points}),
        md.Body("rod", {"C": (0, 0), "E": (3, 0)}),
        md.Body("out", {"F": (0, 0), "E": (2.2, 0)}),
    ]
    ends = {
        "A": ("ground.A", "crank.A"), "B": ("crank.B", "coupler.B"), "D": ("ground.D", "rocker.D"),
        "C1": ("coupler.C", "rocker.C"), "C2": (f"rocker.{second}", "rod.C"),
        "E": ("rod.E", "out.E"), "F": ("ground.F", "out.F"),
    }  # fmt: skip
    degrees = {"crank": 60, "coupler": 30, "rocker": 110, "rod": -5, "out": 80}
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (4, 0), "F": (6, 1)}),
        bodies=bodies,
        joints=[md.Revolute(name, *own) for name, own in ends.items()],
        sketch={name: math.radians(value) for name, value in degrees.items()},
    )


def meet(a: complex, ra: float, b: complex, rb: float, side: int) -> complex:
    """Return where two circles meet, on the left of the way from a to b for side 1."""
    way = b - a
    along = (ra**2 - rb**2 + abs(way) ** 2) / (2 * abs(way))
    return a + way / abs(way) * (along + side * 1j * math.sqrt(ra**2 - along**2))


def test_two_points_of_a_link_may_be_one_pin() -> None:
    """Three links on a pin: two intersections of circles."""
    driver = md.Driver("crank.angle", at=[math.radians(60)])
    result = md.solve(three_on_a_pin("C2", {"C2": (2.5, 0)}), md.Sweep(driver))
    c = meet(np.exp(1j * math.radians(60)), 3.0, 4.0, 2.5, 1)
    e = meet(c, 3.0, 6 + 1j, 2.2, 1)
    out = float(np.angle(e - (6 + 1j)))
    assert math.degrees(out) == pytest.approx(90.32263787944348, abs=1e-11)
    assert result.bodies["out"].angle[0] == pytest.approx(out, abs=1e-13)
    modes = [
        md.solve(three_on_a_pin(*own), md.Modes(driver)).summary["count"]
        for own in (("C2", {"C2": (2.5, 0)}), ("C", {}))
    ]
    assert modes == [4, 4]


def test_a_link_whose_pins_are_all_one_point_has_no_length() -> None:
    with pytest.raises(MechanismError, match="link of zero length: its pins C and E"):
        three_on_a_pin("C", {}).with_values({"rod.E.x": 0.0})


def test_a_far_sketch_names_the_body_that_is_farthest() -> None:
    """The other mode of the rocker's dyad: both bodies are told, the farther one with its angle."""
    mechanism = three_on_a_pin("C", {})
    far = dict(mechanism.sketch) | {"out": math.radians(-20), "rod": math.radians(-60)}
    driver = md.Driver("crank.angle", at=[math.radians(60)])

    result = md.solve(replace(mechanism, sketch=far), md.Sweep(driver))
    note = next(own for own in result.summary["notes"] if "degrees away" in own)
    found = re.search(r"(rod|out) most of all, at (-?\d+) deg", note)
    assert found is not None
    bodies = {name: result.bodies[name].angle[0] for name in ("rod", "out")}
    off = {n: abs(math.remainder(a - far[n], 2 * math.pi)) for n, a in bodies.items()}
    assert found[1] == max(off, key=off.__getitem__)
    assert int(found[2]) == round(math.degrees(math.remainder(bodies[found[1]], 2 * math.pi)))


def test_some_of_several_drivers_are_sketched_where_the_others_do_not_begin() -> None:
    """An arm of two links of length 1: at the sketched angle 0 its tip is nowhere left of 0.

    It is driven from 100 degrees on with its tip at x = -0.2: cos 100 + cos(100 + elbow) = -0.2.
    """
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("upper", {"O": (0, 0), "E": (1, 0)}),
            md.Body("fore", {"E": (0, 0), "T": (1, 0)}),
        ],
        joints=[md.Revolute("O", "ground.O", "upper.O"), md.Revolute("E", "upper.E", "fore.E")],
        sketch={"upper": 0.0, "fore": 1.6},
    )
    angle = md.Driver("upper.angle", from_=np.radians(100), to=np.radians(110))
    across = md.Driver("fore.T.x", from_=-0.2, to=-0.3)
    result = md.solve(mechanism, md.Sweep(drivers=(angle, across), poses=3))
    assert list(result.status) == ["ok"] * 3
    fore = np.arccos(np.array([-0.2, -0.25, -0.3]) - np.cos(np.radians([100, 105, 110])))
    assert result.bodies["fore"].angle == pytest.approx(fore, abs=1e-12)
    notes = " ".join(result.summary["notes"])
    assert "upper.angle = 0 deg does not close; begun at upper.angle = 100 deg" in notes
    with pytest.raises(md.AssemblyError, match=r"fore\.T\.x"):
        md.solve(mechanism, md.Sweep(drivers=(angle, replace(across, from_=-2.1, to=-2.3))))
