"""Pressure and wear of contacts. Truths: closed forms, integrated here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from tests.shared.along_cycle import WORDS, agrees, largest, root
from tests.shared.command import run

OMEGA, R, L, MASS, LOAD = 40.0, 0.1, 0.3, 2.0, 900.0
WIDTH, LENGTH, BESIDE = 0.03, 0.08, 0.005
E_PRIME = 2.2e11


def slider_crank(**guide: object) -> md.Mechanism:
    """A massless crank and rod, a heavy slider that a constant force pushes back; no friction."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "B": (R, 0)}),
            md.Body("rod", {"B": (0, 0), "C": (L, 0)}),
            md.Body("slider", {"C": (0, 0), "P": (0, BESIDE)}, mass=MASS),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O", pin_radius=0.02, face_width=WIDTH),
            md.Revolute("B", "crank.B", "rod.B", pin_radius=0.015, face_width=WIDTH),
            md.Revolute("C", "rod.C", "slider.C", pin_radius=0.01, face_width=WIDTH),
            md.Prismatic(
                "slide", "ground.O", "slider.C", contact_length=LENGTH, face_width=WIDTH, **guide
            ),
        ],
        loads=[md.Force("push", "slider.P", (-LOAD, 0.0))],
        sketch={"crank": 1.0, "rod": -0.25},
    )


def turn(**more: object) -> md.Reactions:
    driver = md.Driver("crank.angle", from_=0.0, to=2 * np.pi, speed=OMEGA)
    return md.Reactions(driver=driver, poses=73, cycle=True, **more)


def test_pins_and_a_block_of_a_slider_crank() -> None:
    wear = md.solve(slider_crank(), turn()).summary["wear"]

    def rod(s):
        return np.arcsin(-R / L * np.sin(s))

    def turning(s):  # of the rod, per radian of the crank
        return -R * np.cos(s) / (L * np.cos(rod(s)))

    def axial(s):  # of the rod, from the slider's law: x'' from x' = -r sin + l sin(b) |b'| ...
        b, rate = rod(s), turning(s)
        second = (R * np.sin(s) / L + np.sin(b) * rate**2) / np.cos(b)
        acceleration = -R * np.cos(s) - L * np.cos(b) * rate**2 - L * np.sin(b) * second
        return (MASS * OMEGA**2 * acceleration + LOAD) / np.cos(b)

    breaks = [0, np.pi / 2, np.pi, 3 * np.pi / 2, 2 * np.pi]
    grid = np.linspace(0, 2 * np.pi, 721)
    signs = np.flatnonzero(np.sign(axial(grid[1:])) != np.sign(axial(grid[:-1])))
    breaks = sorted([*breaks, *(root(axial, grid[k], grid[k + 1]) for k in signs)])
    period = 2 * np.pi / OMEGA
    for name, radius, rate in (
        ("O", 0.02, lambda s: np.ones_like(s)), ("B", 0.015, lambda s: turning(s) - 1),
        ("C", 0.01, turning),
    ):  # fmt: skip
        agrees(
            wear[name], lambda s, r=radius: np.abs(axial(s)) / (2 * r * WIDTH),
            lambda s, r=radius, w=rate: r * OMEGA * w(s), breaks, period,
        )  # fmt: skip

    # the force of the load acts beside the pin: the block bears at its ends where
    # |M|/(l/2) is more than |N|
    def bearing(s):
        return np.maximum(np.abs(axial(s) * np.sin(rod(s))), LOAD * BESIDE / (LENGTH / 2))

    def edge(s):
        return np.abs(axial(s) * np.sin(rod(s))) - LOAD * BESIDE / (LENGTH / 2)

    signs = np.flatnonzero(np.sign(edge(grid[1:])) != np.sign(edge(grid[:-1])))
    tips = [root(edge, grid[k], grid[k + 1]) for k in signs]
    assert len(tips) >= 2, "tilting has to begin and to end"
    agrees(
        wear["slide"], lambda s: bearing(s) / (LENGTH * WIDTH),
        lambda s: OMEGA * (-R * np.sin(s) - L * np.sin(rod(s)) * turning(s)),
        sorted([*breaks, *tips]), period,
    )  # fmt: skip


def test_series_hold_at_every_pose_and_losses_follow() -> None:
    mechanism = slider_crank(friction=0.12)
    result = md.solve(mechanism, turn(friction="coupled"))
    slide = result.joints["slide"]
    area = LENGTH * WIDTH
    assert slide.pv == pytest.approx(slide.pressure * slide.sliding_speed, rel=1e-15)
    assert slide.loss == pytest.approx(0.12 * area * slide.pv, rel=1e-12, abs=1e-9)
    share = result.summary["wear"]["slide"]["mean_pv"] * 0.12 * area
    assert share == pytest.approx(result.summary["loss_by_joint"]["slide"], rel=1e-10)
    assert result.unit("joints", "slide", "pv") == "W/m2"
    assert "mean pv [W/m2]" in str(result)


def test_the_seal_of_a_wankel_rotor() -> None:
    """A tip in a hollow and over a waist: the curvature of the housing changes its sign."""
    problem = md.load("wankel-rotor")
    numbers = problem.mechanism.values()
    radius, e, f, push, mass, d = (numbers[k] for k in ("R", "e", "f", "S", "m_seal", "d"))
    tip, width = 0.003, 0.08
    changed = [
        replace(joint, face_width=width, tip_radius=tip, contact_modulus=E_PRIME)
        if joint.on_curve else joint
        for joint in problem.mechanism.joints.values()
    ]  # fmt: skip
    mechanism = replace(problem.mechanism, joints={j.name: j for j in changed})
    wear = md.solve(replace(problem, mechanism=mechanism), "cycle").summary["wear"]
    omega = numbers["omega"] / 3  # of the rotor

    def rate(u):
        return np.sqrt(radius**2 + 9 * e**2 + 6 * e * radius * np.cos(2 * u))

    def pressure(u):
        leaning = np.arctan2(3 * e * np.sin(2 * u), radius + 3 * e * np.cos(2 * u))
        # along the slot: the rotor's centre and the centre of mass of the seal
        outwards = -(omega**2) * ((radius - d) + 9 * e * np.cos(2 * u))
        force = (push - mass * outwards) / (np.cos(leaning) - f * np.sin(leaning))
        curve = (radius**2 + 27 * e**2 + 12 * e * radius * np.cos(2 * u)) / rate(u) ** 3
        return np.sqrt(force / width * E_PRIME / (2 * np.pi) * (1 / tip - curve))

    breaks = np.linspace(0, 2 * np.pi, 17)
    for k in range(3):
        agrees(wear[f"housing{k}"], pressure, lambda u: omega * rate(u), breaks, 2 * np.pi / omega)


@pytest.mark.parametrize("turns", [False, True])
def test_a_round_cam_under_a_roller(turns: bool) -> None:
    disk, roller, e, push = 0.03, 0.01, 0.015, 120.0
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0)}), md.Body("follower", {"R": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Prismatic("guide", "ground.O", "follower.R", axis=np.pi / 2),
            md.Curve(
                "profile", "crank.O", "follower.R", x=f"{e} + {disk}*cos(s)", y=f"{disk}*sin(s)",
                closed=True, roller_radius=roller, face_width=WIDTH, contact_modulus=E_PRIME,
                **({} if turns else {"friction": 0.0}),
            ),
        ],
        loads=[md.Force("push", "follower.R", (0.0, -push))],
        sketch={"crank": 0.0, "guide": 0.04},
    )  # fmt: skip
    wear = md.solve(mechanism, turn()).summary["wear"]["profile"]
    far = disk + roller

    def lean(s):  # of the line of centres against the guide
        return np.arcsin(e / far * np.cos(s))

    def pressure(s):
        force = push / np.cos(lean(s))
        curved = 1 / disk + 1 / roller
        return np.sqrt(force / WIDTH * E_PRIME / (2 * np.pi) * curved)

    def speed(s):
        # the follower rises with y' = e cos + (far cos lean)'; the cam's surface turns about O
        rise = e * np.cos(s) + e**2 * np.sin(s) * np.cos(s) / (far * np.cos(lean(s)))
        centre = e * np.array([np.cos(s), np.sin(s)])
        normal = np.array([-np.sin(lean(s)), np.cos(lean(s))])
        place = centre + disk * normal
        tangent = np.array([normal[1], -normal[0]])
        surface = np.array([-place[1], place[0]])
        return OMEGA * (tangent[1] * rise - (tangent * surface).sum(axis=0))

    breaks = np.linspace(0, 2 * np.pi, 9)
    if turns:
        assert wear["peak_pressure"] == pytest.approx(largest(pressure, breaks), rel=1e-9)
        assert [wear[word] for word in WORDS[1:]] == [0, 0, 0]
        return
    agrees(wear, pressure, speed, breaks, 2 * np.pi / OMEGA)


@pytest.mark.parametrize("shoe", [None, 0.04])
def test_a_pin_in_a_slot_rolls_and_slides_a_shoe_slides(shoe: float | None) -> None:
    """A Scotch yoke: the slot passes the pin, whose surface turns with the crank."""
    radius = 0.008
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "B": (R, 0)}),
            md.Body("yoke", {"Y": (0, 0)}, mass=MASS),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.PinInSlot(
                "slot", "yoke.Y", "crank.B", axis=np.pi / 2, face_width=WIDTH, pin_radius=radius,
                **({"shoe_length": shoe} if shoe else {"contact_modulus": E_PRIME}),
            ),
            md.Prismatic("guide", "ground.O", "yoke.Y"),
        ],
        sketch={"crank": 0.5},
    )  # fmt: skip
    wear = md.solve(mechanism, turn()).summary["wear"]["slot"]

    def force(s):  # on the yoke, along x
        return -MASS * R * OMEGA**2 * np.cos(s)

    def pressure(s):
        if shoe:
            return np.abs(force(s)) / (shoe * WIDTH)
        return np.sqrt(np.abs(force(s)) / WIDTH * E_PRIME / (2 * np.pi * radius))

    def speed(s):
        # the pin presses where its surface is at +-radius along x: there it moves by +-radius
        on_surface = 0.0 if shoe else radius * np.sign(force(s))
        return OMEGA * (R * np.cos(s) + on_surface)

    zero = float(np.arccos(radius / R))
    breaks = sorted({0.0, zero, np.pi / 2, np.pi - zero, np.pi, np.pi + zero, 1.5 * np.pi,
                     2 * np.pi - zero, 2 * np.pi})  # fmt: skip
    # roots of the force at a quarter and three quarters: intervals shrink towards them
    near = [np.pi / 2 * (2 * k + 1) + side * 0.5**n for k in (0, 1) for side in (1, -1)
            for n in range(4, 45)]  # fmt: skip
    agrees(wear, pressure, speed, sorted({*breaks, *near}), 2 * np.pi / OMEGA)


def test_a_tip_in_a_narrower_hollow_has_no_pressure() -> None:
    problem = md.load("wankel-rotor")
    joints = {
        name: replace(joint, face_width=0.08, tip_radius=0.2, contact_modulus=E_PRIME)
        if name == "housing0" else joint
        for name, joint in problem.mechanism.joints.items()
    }  # fmt: skip
    mechanism = replace(problem.mechanism, joints=joints)
    result = md.solve(replace(problem, mechanism=mechanism), "cycle")
    lost = np.isnan(result.joints["housing0"].pressure)
    assert 0 < lost.sum() < len(lost)  # over the waist it touches along a line
    assert any("housing0: its tip is less curved" in note for note in result.summary["notes"])
    assert np.isnan(result.summary["wear"]["housing0"]["peak_pressure"])
    assert result.summary["wear"]["housing0"]["sliding_distance"] > 0


FILE = """
schema = 1
[ground]
points = { O = [0, 0] }
[bodies.crank]
points = { O = [0, 0], B = [0.1, 0] }
[bodies.yoke]
points = { Y = [0, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"], PIN }
slot = { kind = "pin-in-slot", between = ["yoke.Y", "crank.B"], axis_deg = 90, SLOT }
guide = { kind = "prismatic", between = ["ground.O", "yoke.Y"], GUIDE }
[tasks.cycle]
kind = "reactions"
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360, speed = 1 }
"""


@pytest.mark.parametrize(
    ("part", "keys", "where", "message"),
    [
        ("PIN", "face_width = 0.03", "joints.O.face_width", "needs face_width and pin_radius"),
        ("PIN", "face_width = 0, pin_radius = 0.01", "joints.O.face_width", "is zero"),
        ("PIN", "face_width = -1, pin_radius = 0.01", "joints.O.face_width", "is negative"),
        ("GUIDE", "face_width_mm = 30", "joints.guide.face_width", "and contact_length"),
        ("SLOT", "contact_modulus = 2e11", "joints.slot.contact_modulus",
         "needs face_width and shoe_length, or face_width and pin_radius and contact_modulus"),
        ("SLOT", "face_width = 0.03, pin_radius = 0.01", "joints.slot.face_width", "needs"),
        ("SLOT", "shoe_length = 0.03", "joints.slot.shoe_length", "needs face_width"),
        ("GUIDE", "face_widht = 0.03", "joints.guide: unknown key", "did you mean face_width?"),
    ],
)  # fmt: skip
def test_surfaces_that_are_none_are_refused(capsys, tmp_path, part, keys, where, message) -> None:
    text = FILE.replace(part, keys)
    for name in ("PIN", "SLOT", "GUIDE"):
        text = text.replace(f", {name} }}", " }")
    file = tmp_path / "yoke.toml"
    file.write_text(text)
    code, _, err = run(capsys, "solve", str(file))
    assert code == 2
    assert where in err
    assert message in err
