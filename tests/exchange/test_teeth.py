"""Gears to cut and print: true involutes, teeth that mesh at the pose and never meet.

Flanks are compared with the closed form of the involute (base circle, thickness at the pitch
circle), contact ratios with the length of the line of action between the tip circles over the base
pitch, closed trains with the condition of their assembly, (sun + ring) * angle = whole turns.
"""

from __future__ import annotations

import re
from dataclasses import replace
from math import cos, pi, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.exchange.workshop.outlines import Bend
from mechdae.parts.exchange.workshop.teeth import Teeth, ToothedLoop, least_gap
from tests.shared.meshing import faults, pair
from tests.shared.solids import Assembly, inside, open_sides, sides_below, step_volumes

ALPHA = radians(20)


def planets(degrees: float) -> md.Problem:
    """Return a planetary train, 24, 18 and 60 teeth, with two planets at an angle."""
    a, angle = 0.042, radians(degrees)
    places = {"O": [0, 0], "P": [a, 0], "Q": [a * cos(angle), a * sin(angle)]}
    bodies = [
        md.Body("sun", points={"O": [0, 0]}), md.Body("p", points={"P": [0, 0]}),
        md.Body("q", points={"Q": [0, 0]}), md.Body("carrier", points=places),
    ]  # fmt: skip
    joints = [
        md.Revolute("S", "ground.O", "sun.O"), md.Revolute("C", "ground.O", "carrier.O"),
        md.Revolute("P", "carrier.P", "p.P"), md.Revolute("Q", "carrier.Q", "q.Q"),
    ]  # fmt: skip
    for planet in ("p.P", "q.Q"):
        for wheel, teeth, mesh in (("sun.O", 24, "external"), ("ground.O", 60, "internal")):
            name = f"{wheel[0]}{planet[0]}"
            keys = {"carrier": "carrier", "teeth": [teeth, 18], "mesh": mesh}
            joints.append(md.Gear(name, wheel, planet, **keys))
    mechanism = md.Mechanism(md.Ground({"O": [0, 0]}), bodies, joints, sketch={"sun": 0.0})
    return md.Problem(mechanism, {"turn": md.Sweep(md.Driver("sun.angle", from_=0, to=7), poses=9)})


def rows(problem: md.Problem, **sizes: float) -> str:
    return md.export(problem, format="svg-cut", **sizes).files["parts.csv"]


def involute(angle):
    return np.tan(angle) - angle


@pytest.mark.parametrize("ring", [False, True])
def test_flanks_are_involutes_of_the_base_circle(ring: bool) -> None:
    """The curves are off by less than 1e-6 of the module, also between their ends."""
    m, z, thin = 0.002, 41, 4e-5
    r = m * z / 2
    teeth = Teeth(np.zeros(2), z, r, m, ALPHA, 0.3, thin, ring, m)
    half = (pi * m / 2 + (thin if ring else -thin)) / (2 * r)  # half of a tooth or a space
    first = 0.3 + (pi / z if ring else 0.0)
    worst = 0.0
    bends = [side for side in ToothedLoop(teeth).sides() if isinstance(side, Bend)]
    for bend in bends:
        for place in bend.points(float(np.hypot(*(bend.end - bend.begin))) / 7):
            size = float(np.hypot(*place))
            angle = (np.arctan2(place[1], place[0]) - first) % (2 * pi / z)
            angle = min(angle, 2 * pi / z - angle)
            known = half + involute(ALPHA) - involute(np.arccos(min(1.0, r * cos(ALPHA) / size)))
            worst = max(worst, r * cos(ALPHA) * abs(angle - known))
    assert len(bends) >= 4 * z
    assert worst < 1e-6 * m


def test_a_kerf_leaves_flanks_that_are_offset_by_half_of_it() -> None:
    """Parallel curves of an involute are involutes of the same base circle."""
    m, z, by = 0.002, 41, 1e-4
    teeth = Teeth(np.zeros(2), z, m * z / 2, m, ALPHA, tip=m)
    plain, grown = (ToothedLoop(teeth).grown(b).polygon(apart=m / 200) for b in (0.0, by))
    size = np.hypot(*grown.T)
    flank = grown[(size > teeth.low + m / 2) & (size < teeth.high - m / 2)][:200:5]
    sides = np.stack([plain, np.roll(plain, -1, axis=0)], 1)[: len(plain) // 8]
    way = sides[:, 1] - sides[:, 0]
    to = flank[:, None] - sides[:, 0]
    share = np.clip((to * way).sum(-1) / (way * way).sum(-1), 0, 1)
    far = np.hypot(*(to - share[..., None] * way).transpose(2, 0, 1)).min(axis=1)
    assert np.abs(far - by).max() < 1e-3 * by


@pytest.mark.parametrize(
    ("teeth", "mesh", "far"), [((20, 50), "external", 0.07), ((20, 56), "internal", 0.036)]
)
def test_contact_ratios_are_those_of_the_line_of_action(teeth, mesh: str, far: float) -> None:
    text = rows(pair(teeth, mesh, far))
    found = float(re.search(r"contact ratio (\S+);", text)[1])
    m, sense = 0.002, 1 if mesh == "external" else -1
    centres = np.array([[0.0, 0.0], [sense * far, 0.0]])
    radii = [z * m / 2 for z in teeth]
    shares = [float(x) for x in re.findall(r"addendum (\S+) modules", text)]
    tips = [radii[0] + m * shares[0], radii[1] + sense * m * shares[1]]
    way = np.array([sin(ALPHA), cos(ALPHA)])  # the line of action through the pitch point
    pitch = np.array([radii[0], 0.0])
    reach = []
    for centre, tip in zip(centres, tips, strict=True):
        b = way @ (pitch - centre)
        reach.append(sorted((-b + s * sqrt(b * b + tip**2 - (pitch - centre) @ (pitch - centre)))
                            for s in (-1, 1)))  # fmt: skip
    ends = (max(reach[1][0], -np.inf), reach[0][1]) if sense > 0 else (reach[1][1], reach[0][1])
    assert found == pytest.approx(abs(ends[1] - ends[0]) / (pi * m * cos(ALPHA)), abs=1e-3)


def test_backlash_thins_teeth_and_is_the_gap_along_the_normal() -> None:
    """Half of it lies on either side of a tooth in the middle: j cos(alpha)/2."""
    m, j = 0.002, 1e-4
    for z, inside_ in ((50, False), (60, True)):
        one = Teeth(np.zeros(2), 20, 10 * m, m, ALPHA, thin=j / 2, tip=m)
        mate = Teeth(np.zeros(2), z, z * m / 2, m, ALPHA, thin=j / 2, inside=inside_, tip=0.9 * m)
        far = mate.radius + (-1 if inside_ else 1) * one.radius
        gap, bound = least_gap(one, mate, far)
        assert gap == pytest.approx(j * cos(ALPHA) / 2, rel=1e-3)
        assert 0 < bound < gap
    rack = Teeth(np.zeros(2), 9, np.inf, m, ALPHA, thin=j / 2, tip=m)
    assert least_gap(one, rack, one.radius)[0] == pytest.approx(j * cos(ALPHA) / 2, rel=1e-3)
    assert "backlash 0.3 mm" in rows(pair(backlash=3e-4))
    assert "backlash 0.1 mm" in rows(pair(), backlash=1e-4)


def test_wheels_mesh_at_the_pose() -> None:
    off, gap = faults()
    assert off < 1e-6
    assert gap < 1e-3


def test_teeth_without_backlash_touch_and_planted_thickness_is_met() -> None:
    m = 0.002
    one = Teeth(np.zeros(2), 20, 10 * m, m, ALPHA, tip=m)
    mate = Teeth(np.zeros(2), 50, 25 * m, m, ALPHA, tip=m)
    assert abs(least_gap(one, mate, 35 * m)[0]) < 1e-6 * m
    thick = replace(mate, thin=-1e-3 * m)
    assert least_gap(one, thick, 35 * m)[0] == pytest.approx(-5e-4 * m * cos(ALPHA), rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planetary-gear-train", "rack-and-pinion"])
def test_wheels_of_an_assembly_never_meet(name: str) -> None:
    found = Assembly(name, 160)
    found.rows = found.rows[::7]
    assert not found.overlaps()
    assert all(open_sides(s) == 0 for several in found.solids.values() for s in several)


@pytest.mark.slow
def test_solids_of_step_files_have_the_area_under_involutes(tmp_path: Path) -> None:
    """A tooth's area is the integral of its angle times the radius."""
    pytest.importorskip("OCP.STEPControl", reason="cadquery-ocp-novtk is not installed")
    made = md.export(pair((20, 56), "internal", 0.036), format="step", pin=0.004, thickness=0.003)
    m, r, play = 2.0, 20.0, 0.08  # mm
    base, top, low = r * cos(ALPHA), r + m, r - 1.25 * m
    half = pi / 40 - play / (4 * r) + involute(ALPHA)
    sizes = np.linspace(base, top, 20001)
    angles = half - involute(np.arccos(base / sizes))
    tooth = float(np.sum((angles[1:] + angles[:-1]) / 2 * np.diff(sizes**2)))
    tooth += (base**2 - low**2) * half  # radial below the base circle
    area = pi * low**2 + 20 * tooth - pi * 2.04**2
    volumes = step_volumes(made.text, tmp_path / "x.step")
    assert min(abs(volume / (3 * area) - 1) for volume in volumes) < 1e-6


def test_a_wheel_turned_by_half_of_a_pitch_would_be_seen_to_meet() -> None:
    """In the first pose no corner of a wheel lies in the other one; turned some do."""
    found = Assembly(pair(), 8)
    (one,), (two,) = found.solids["one"], found.solids["two"]
    corners, sides = sides_below(one)[:, 0], sides_below(two)
    assert not inside(corners, sides).any()
    t = pi / 20
    turned = corners @ np.array([[cos(t), sin(t)], [-sin(t), cos(t)]])
    assert inside(turned, sides).any()


def test_closed_trains_close_or_are_refused_with_the_figure() -> None:
    """(24 + 60) * 180 / 360 = 42 is whole, (24 + 60) * 170 / 360 = 39 + 2/3 is not."""
    assert rows(planets(180)).count("mesh,") == 4
    with pytest.raises(md.UnavailableError, match=r"its teeth are 0\.3333 of a pitch off"):
        rows(planets(170))


def test_no_pin_reaches_through_what_passes_over_it() -> None:
    """A planet with an arm of 60 mm, 50 mm from the axis of a wheel of the frame and the carrier.

    What holds both wheels on the axis comes from two sides of the layer of the planet's arm.
    """
    arm = md.Body("arm", points={"O": [0, 0], "P": [0.05, 0]})
    planet = md.Body("planet", points={"P": [0, 0], "T": [0.06, 0]})
    joints = [md.Revolute("O", "ground.O", "arm.O"), md.Revolute("P", "arm.P", "planet.P")]
    joints.append(md.Gear("g", "ground.O", "planet.P", carrier="arm", ratio=-2 / 3))
    mechanism = md.Mechanism(md.Ground({"O": [0, 0]}), [arm, planet], joints, sketch={"arm": 0.3})
    driver = md.Driver("arm.angle", from_=0, to=7)
    text = rows(md.Problem(mechanism, {"turn": md.Sweep(driver, poses=9)}))
    layer = int(re.search(r"^planet,1,(\d+)", text, re.MULTILINE)[1])
    spans = re.findall(r"^pin O\S*(?: wheel)?,.*layers (\d+) to (\d+)", text, re.MULTILINE)
    assert len(spans) == 2
    assert not any(int(low) <= layer <= int(high) for low, high in spans)


def test_numbers_of_teeth_are_the_smallest_without_undercut_or_those_asked_for() -> None:
    """17.1 teeth are the least at 20 degrees, 2/sin^2: of 2:5 the first pair is 18:45."""
    problem = pair()
    joints = dict(problem.mechanism.joints)
    joints["mesh"] = replace(joints["mesh"], teeth=None, mesh=None, ratio=-2.5)
    plain = replace(problem, mechanism=replace(problem.mechanism, joints=joints))
    assert re.findall(r"(\d+) teeth", rows(plain)) == ["18", "45"]
    assert re.findall(r"(\d+) teeth", rows(plain, teeth=24)) == ["24", "60"]
    assert re.findall(r"(\d+) teeth; module (\S+) mm", rows(plain, module=0.001)) == [
        ("40", "1"), ("100", "1"),
    ]  # fmt: skip
    with pytest.raises(md.InputError, match="has 2 teeth or a multiple, not 21"):
        rows(plain, teeth=21)
    with pytest.raises(md.InputError, match="no teeth that the file leaves open"):
        rows(problem, teeth=20)
    joints["mesh"] = replace(joints["mesh"], ratio=-sqrt(2))
    odd = replace(problem, mechanism=replace(problem.mechanism, joints=joints))
    with pytest.raises(md.UnavailableError, match=r"ratio 1\.41421356 is none of whole"):
        rows(odd)


def test_wheels_that_cannot_mesh_are_refused_with_the_figure() -> None:
    """A ring of two teeth more than its wheel: tips meet; six teeth: they hardly reach."""
    with pytest.raises(md.UnavailableError, match=r"teeth meet by \S+ modules"):
        rows(pair((18, 20), "internal", 0.002))
    with pytest.raises(md.UnavailableError, match=r"contact ratio is 0\.\d+, below 1"):
        rows(pair((4, 40), "external", 0.044))
