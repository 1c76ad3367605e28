"""One-sided contacts in space: where they would have to pull. Truths: closed forms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from mechdae.results.tables import table

G = 9.81
BALL = (1e-3, 1e-3, 1e-3)


def lifts(result: Any) -> list[Any]:
    return [event for event in result.events if event["kind"] == "lift_off"]


def swing(*ropes: Any, length: float = 0.5, tilt: float = 0.4) -> md.Mechanism:
    """A stone slides on an arm that turns in a tilted plane, a rope holds it to the pivot."""
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[
            md.Body("arm", {"O": (0, 0, 0)}),
            md.Body("stone", {"C": (0, 0, 0)}, mass=2.0, inertia=BALL),
        ],
        joints=[
            md.SpatialRevolute("O", "ground.O", "arm.O", axis=(0, -np.cos(tilt), np.sin(tilt)),
                               zero=(1, 0, 0)),
            md.SpatialPrismatic("slide", "arm.O", "stone.C", axis=(1, 0, 0)),
            *ropes,
        ],
        gravity=(0, 0, -G),
        sketch={"O": 0.0, "slide": length},
    )  # fmt: skip


def rope(side: str | None, length: float = 0.5, name: str = "rope") -> md.Distance:
    return md.Distance(name, "ground.O", "stone.C", length=length, one_sided=side)


def test_a_rope_is_slack_where_the_weight_falls_towards_the_pivot() -> None:
    """The pull m (w^2 l - g cos(tilt) sin(angle)), for any side and any size."""
    w, slope = 3.0, np.cos(0.4)
    for size in (1.0, 1e-3):
        length, speed = 0.5 * size, w / np.sqrt(size)
        driver = md.Driver("O.angle", from_=-np.pi / 2, to=1.5 * np.pi, speed=speed)
        pull = swing(rope("pull", length), length=length)
        (event,) = lifts(md.solve(pull, md.Reactions(driver, poses=9)))
        slack = np.arcsin(w**2 * 0.5 / (G * slope))
        assert (event["at"], event["until"]) == pytest.approx((slack, np.pi - slack), abs=1e-11)
        assert event["force"] == pytest.approx(2.0 * (w**2 * 0.5 - G * slope), rel=1e-12)
    prop = lifts(md.solve(swing(rope("push")), md.Reactions(driver=md.Driver(
        "O.angle", from_=-np.pi / 2, to=1.5 * np.pi, speed=w), poses=9)))  # fmt: skip
    assert [e["until"] for e in prop] == pytest.approx([slack, 1.5 * np.pi], abs=1e-11)
    both = swing(rope(None))
    assert not lifts(md.solve(both, md.Reactions(driver, poses=9)))


def test_a_stone_let_go_above_its_rope() -> None:
    """In a vertical plane at any azimuth: m (w^2 l + g cos a) with a from straight down."""
    length, start, azimuth = 0.5, 0.8 * np.pi, 0.7
    out = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    place = length * (np.sin(start) * out + np.array([0, 0, -np.cos(start)]))
    points = {"C": (0, 0, 0), "X": (0.1, 0, 0), "Y": (0, 0.1, 0)}
    sketch = {f"stone.{name}.{axis}": float(place[k] + own[k])
              for name, own in points.items() for k, axis in enumerate("xyz")}  # fmt: skip
    stone = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[md.Body("stone", points, mass=2.0, inertia=BALL)],
        joints=[rope("pull")],
        gravity=(0, 0, -G),
        sketch=sketch,
    )  # fmt: skip
    start_at = {f"stone.C.{axis}": float(v) for axis, v in zip("xyz", place, strict=True)}
    result = md.solve(stone, md.Motion(start=start_at, until=0.6, poses=7, tolerance=1e-11))
    (event,) = lifts(result)
    assert event["at"] == pytest.approx(0.0, abs=1e-12)
    assert event["force"] == pytest.approx(2.0 * G * np.cos(start), rel=1e-9)
    # from rest w^2 = 2 g (cos a - cos start) / l: it holds again where cos a = 2/3 cos start
    angle = np.arccos(2 * np.cos(start) / 3)
    x, weights = np.polynomial.legendre.leggauss(400)
    edge = np.sqrt(start - angle)
    s = edge * (x + 1) / 2
    rate = np.sqrt(2 * G / length * (np.cos(start - s**2) - np.cos(start)))
    time = float(np.sum(weights * edge / 2 * 2 * s / rate))
    assert event["until"] == pytest.approx(time, rel=1e-7)
    pull = f"{-2.0 * G * np.cos(start):.6g} N"
    told = f"lift off  t = 0 s: joint rope would have to pull, by up to {pull}, until t = "
    assert told in table(result)


@pytest.mark.parametrize("side", ["positive", "negative"])
def test_a_block_on_a_plate_that_shakes(side: str) -> None:
    """It lies on the plate or hangs under it: m (g - A w^2 sin(w t)) along the plate's normal."""
    A, w, m = 0.01, 40.0, 3.0
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[
            md.Body("plate", {"O": (0, 0, 0), "P": (0.1, 0.2, 0)}),
            md.Body("block", {"B": (0, 0, 0)}, mass=m, inertia=BALL, center=(0, 0, 0.02)),
        ],
        joints=[
            md.SpatialPrismatic("lift", "ground.O", "plate.O", axis=(0, 0, 1)),
            md.PlanarPair("seat", "plate.P", "block.B", axis=(0, 0, 2), one_sided=side),
        ],
        gravity=(0, 0, -G),
    )
    drive = md.Driver("lift.slide", law=f"{A}*sin({w}*t)")
    task = md.Motion(drivers=(drive,), until=2 * np.pi / w, poses=5, tolerance=1e-11)
    found = lifts(md.solve(mechanism, task))
    first = np.arcsin(G / (A * w**2)) / w
    if side == "positive":
        (event,) = found
        assert (event["at"], event["until"]) == pytest.approx((first, np.pi / w - first), rel=1e-7)
        assert event["force"] == pytest.approx(m * (G - A * w**2), rel=1e-8)
    else:
        assert [e["joint"] for e in found] == ["seat", "seat"]
        assert found[0]["until"] == pytest.approx(first, rel=1e-7)


def bevel(side: str, second: tuple[float, ...] = (1, 0, 0)) -> md.Mechanism:
    """A wheel about z drives one about x, whose inertia it speeds up and slows down."""
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": (0, 0, 0.1), "B": (0.2, 0, 0)}),
        bodies=[
            md.Body("pinion", {"A": (0, 0, 0)}),
            md.Body("wheel", {"B": (0, 0, 0), "M": (0, 0.01, 0.02)}, mass=1.0,
                    inertia=(0.3, 0.3, 0.3)),
        ],
        joints=[
            md.SpatialRevolute("A", "ground.A", "pinion.A", axis=(0, 0, 1)),
            md.SpatialRevolute("B", "ground.B", "wheel.B", axis=second),
            md.SpatialGear("teeth", "pinion.A", "wheel.B", ratio=-2 * second[0], radius=0.1,
                           one_sided=side),
        ],
        sketch={"A": 0.0},
    )  # fmt: skip


@pytest.mark.parametrize("side", ["positive", "negative"])
@pytest.mark.parametrize("sense", [1, -1])
def test_teeth_change_flanks_where_the_driven_wheel_is_slowed(side: str, sense: int) -> None:
    """Moment on the wheel: J times its acceleration, that of the pinion over the ratio."""
    w = 3.0
    drive = md.Driver("A.angle", law=f"sin({w}*t)", times=list(np.linspace(0.01, 2.0, 9)))
    result = md.solve(bevel(side, (sense, 0, 0)), md.Reactions(drive))
    # 0.3 * w^2 sin(w t) / 2 about x, in the sense of the wheel's own axis or against it
    (event,) = lifts(result)
    half = np.pi / w
    late = (side == "positive") == (sense > 0)
    wanted = (half, 2.0) if late else (0.01, half)
    assert (event["at"], event["until"]) == pytest.approx(wanted, rel=1e-9)
    assert event["force"] == pytest.approx(-0.3 * w**2 / 2, rel=1e-6)
    assert any("N m" in note for note in result.summary["notes"])
    assert f"by up to {-event['force']:.6g} N m" in table(result)


def test_a_rack_is_pushed_along_its_slide() -> None:
    """m times the acceleration of the rack: against its slide while it is slowed."""
    w, m, r = 3.0, 2.0, 0.1
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": (0, 0, 0), "S": (0, -0.1, 0)}),
        bodies=[
            md.Body("wheel", {"A": (0, 0, 0)}),
            md.Body("bar", {"S": (0, 0, 0)}, mass=m, inertia=BALL),
        ],
        joints=[
            md.SpatialRevolute("A", "ground.A", "wheel.A", axis=(0, 0, 1)),
            md.SpatialPrismatic("S", "ground.S", "bar.S", axis=(1, 0, 0)),
            md.SpatialRack("teeth", "wheel.A", "bar.S", radius=r, one_sided="positive"),
        ],
        sketch={"A": 0.0},
    )
    drive = md.Driver("A.angle", law=f"sin({w}*t)", times=list(np.linspace(0.01, 2.0, 9)))
    (event,) = lifts(md.solve(mechanism, md.Reactions(drive)))
    assert (event["at"], event["until"]) == pytest.approx((0.01, np.pi / w), rel=1e-9)
    assert event["force"] == pytest.approx(-m * r * w**2, rel=1e-6)


def test_two_ropes_side_by_side_are_not_watched() -> None:
    """Which of them pulls is open; in a motion too, in the plane as in space."""
    both = swing(rope("pull"), rope("pull", name="other"))
    task = md.Reactions(md.Driver("O.angle", from_=0.0, to=3.0, speed=3.0), poses=5)
    said = "not watched for lifting off, the reaction is not unique"
    motion = md.Motion(start={"O.angle": 0.9}, until=0.2, poses=3)
    for result in (md.solve(both, task), md.solve(both, motion)):
        assert not lifts(result)
        assert any(said in note and "rope" in note for note in result.summary["notes"])
    flat = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("arm", {"O": (0, 0)}),
                md.Body("stone", {"C": (0, 0)}, mass=2.0, inertia=1e-3)],
        joints=[
            md.Revolute("O", "ground.O", "arm.O"),
            md.Prismatic("slide", "arm.O", "stone.C"),
            rope("pull"), rope("pull", name="other"),
        ],
        gravity=(0.0, -G),
        sketch={"arm": 0.9, "slide": 0.5},
    )  # fmt: skip
    result = md.solve(flat, md.Motion(start={"arm": 0.9}, until=0.2, poses=3))
    assert not lifts(result)
    assert any(said in note for note in result.summary["notes"])


def test_an_equilibrium_says_what_its_contacts_would_have_to_do() -> None:
    """A stone of 2 kg on a slide in a plane tilted by 0.4: 2 g cos 0.4 along the slide."""
    for side, said in (("pull", False), ("push", True)):
        hung = swing(rope(side))
        hung = replace(hung, sketch=Table({"O": -np.pi / 2, "slide": 0.5}))
        rest = md.solve(hung, md.Equilibrium(start={"O.angle": -1.5}))
        assert rest.joints["O"].angle[0] == pytest.approx(-np.pi / 2, abs=1e-12)
        notes = [n for n in rest.summary.get("notes", []) if "would have to pull" in n]
        assert len(notes) == said
        if said:
            assert f"by {2 * G * np.cos(0.4):.6g} N" in notes[0]


def test_bad_values_name_their_choices() -> None:
    for make in (
        lambda: md.PlanarPair("s", "a.A", "b.B", axis=(0, 0, 1), one_sided="left"),
        lambda: md.SpatialRack("r", "a.A", "b.B", radius=1.0, one_sided="pull"),
        lambda: md.SpatialGear("g", "a.A", "b.B", ratio=1.5, one_sided="push"),
    ):
        with pytest.raises(md.InputError, match=r"one_sided") as caught:
            make()
        assert "positive" in str(caught.value)
