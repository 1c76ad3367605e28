"""Modes of loops with screws: after a whole turn a nut is elsewhere, which is another mode."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.attack.first_poses_space import SETS, Modes
from tests.attack.spatial_poses import driver_of
from tests.attack.spatial_structures import draw, structure

ARM, BAR, PITCH, SLIDE = 0.3, 0.4, 0.1, 0.5
FAR_OFF = {"J0.angle": 0.0, "J1.angle": 0.2, "J2.angle": 0.234, "J3.angle": 0.12,
           "J3.angle2": 0.0, "J4.angle": 0.112}  # fmt: skip
"""A sketch's angles less those of a mode."""
REACH = 25.0
"""Beyond it the nut is further away than the bar is long [rad]."""


def nut_and_slider(sketched: float, jointed: bool) -> md.Mechanism:
    """A nut's arm that a bar holds to a slide across; the bar a body on a cross, or a distance."""
    bodies = [md.Body("nut", {"O": [0, 0, 0], "P": [ARM, 0, 0]}), md.Body("slider", {"C": [0] * 3})]
    bar: list[md.Joint] = [md.Distance("bar", "nut.P", "slider.C", length=BAR)]
    if jointed:
        bodies.append(md.Body("bar", {"P": [0, 0, 0], "C": [BAR, 0, 0]}))
        axes = {"axis": [0, 1, 0], "axis2": [0, 0, 1]}
        bar = [md.Universal("U", "slider.C", "bar.C", **axes), md.Spherical("B", "nut.P", "bar.P")]
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": [0, 0, 0], "S": [0, 0, 0]}),
        bodies=bodies,
        joints=[
            md.Screw("J", "ground.O", "nut.O", axis=[0, 0, 1], pitch=PITCH),
            md.SpatialPrismatic("X", "ground.S", "slider.C", axis=[1, 0, 0]),
            *bar,
        ],
        sketch={"X.slide": SLIDE, "J.angle": sketched},
    )


def roots() -> list[float]:
    """Return the nut's angles: r2 + c2 - 2 r c cos t + (p t / 2 pi)2 = l2, by bisection."""

    def gap(t: float) -> float:
        height = PITCH * t / (2 * np.pi)
        return ARM**2 + SLIDE**2 - 2 * ARM * SLIDE * np.cos(t) + height**2 - BAR**2

    found, grid = [], np.linspace(-REACH, REACH, 1001)
    for low, high in itertools.pairwise(grid):
        if gap(low) * gap(high) < 0:
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if gap(low) * gap(middle) > 0 else (low, middle)
            found.append((low + high) / 2)
    return found


@pytest.mark.parametrize("jointed", [False, True])
def test_each_turn_of_a_screw_is_a_mode_of_its_own(jointed: bool) -> None:
    asked = md.Modes(driver=md.Driver("X.slide", at=[SLIDE]))
    modes = md.solve(nut_and_slider(0.3, jointed), asked)
    assert set(modes.status) == {"ok"}
    angles = sorted(modes.joints["J"].angle)
    expected = np.repeat(roots(), 1 + jointed)  # the bar's cross has two angles for each place
    assert len(roots()) == 14
    assert angles == pytest.approx(expected, abs=1e-12)
    assert modes.summary["proven"]  # all turns that can be are looked at, box by box


@pytest.mark.parametrize("sketched", [0.3, 6.5, -13.0])
def test_the_sketch_tells_the_turn_of_a_screw(sketched: float) -> None:
    asked = md.Sweep(driver=md.Driver("X.slide", at=[SLIDE]))
    result = md.solve(nut_and_slider(sketched, False), asked)
    nearest = min(roots(), key=lambda t: abs(t - sketched))
    assert list(result.status) == ["ok"]
    assert result.joints["J"].angle[0] == pytest.approx(nearest, abs=1e-12)


def test_a_sketch_among_hundreds_of_modes_is_on_the_nearest() -> None:
    """A loop of two screws, a cross and two slides: more modes than are sought to the end.

    Newton's method from the sketch itself leads to a mode 1.48 away, from around it to one at 0.39.
    """
    rng = np.random.default_rng((140, 7))
    drawn = draw(structure(rng, wheels=False), rng, SETS, near=0.0)
    modes, driver = Modes(drawn, 8, np.random.default_rng(1)), driver_of(drawn)
    sketch = {name: value + FAR_OFF.get(name, 0.0) for name, value in modes.values(0).items()
              if name in FAR_OFF}  # fmt: skip
    mechanism = replace(drawn.mechanisms[8], sketch=Table(sketch))
    held = md.Driver(driver, at=[sketch[driver]])
    result = md.solve(mechanism, md.Sweep(drivers=[held], derivatives=0))
    pose = {name: series.position[0] / modes.unit for name, series in result.points.items()}
    assert modes.same(pose, modes.places(0))


@pytest.mark.parametrize("off", [0.0, 0.01])
def test_places_tell_the_turn_of_a_screw_that_closes_at_each(off: float) -> None:
    """Slides across and along take up any turn of a nut: only sketched places tell which one.

    The modes are found in dual quaternions; those that differ by whole turns are told apart.
    """
    rng = np.random.default_rng((158, 7))
    drawn = draw(structure(rng, wheels=False), rng, SETS, near=0.0)
    modes, driver = Modes(drawn, 3, np.random.default_rng(1)), driver_of(drawn)
    turned = {round(modes.values(k)["J2.angle"] % (2 * np.pi), 3) for k in modes.every}
    assert len(turned) < len(modes.every), "some differ by a turn of the screw alone"
    for k in modes.every:
        sketch = {name: value + off * modes.unit * rng.uniform(-1, 1) * (name != driver)
                  for name, value in modes.told(k).items()
                  if name == driver or name.count(".") == 2}  # fmt: skip
        held = (md.Driver(driver, at=[sketch[driver]]),)
        tasks = {"sweep": md.Sweep(drivers=held, derivatives=0), "modes": md.Modes(drivers=held)}
        mechanism = replace(drawn.mechanisms[3], sketch=Table(sketch))
        problem = md.Problem(mechanism, tasks=Table(tasks))
        for name in tasks:
            result = md.solve(problem, name)
            poses = [
                {point: series.position[j] / modes.unit for point, series in result.points.items()}
                for j in range(len(result.status))
            ]
            assert any(modes.same(pose, modes.places(k)) for pose in poses), name
