"""Zhukovsky's lever: the velocity plan turned by a right angle as a lever about its pole.

Every force is put, as it is, at the end of the turned velocity of the point it acts at; its
moment about the pole is then its power, and all moments together vanish. A couple is two
forces at the images of two points of its link, so is the balancing torque of the driver. The
plan is turned clockwise, so that counter-clockwise moments are positive powers.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mechdae.draw import style
from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.fonts import font, ink
from mechdae.draw.plans.board import (
    caption,
    draw_arrow,
    draw_vectors,
    heading,
    scale_text,
    smallest,
    write,
)
from mechdae.draw.plans.forces import BodyForces
from mechdae.draw.plans.relations import motion_plan
from mechdae.draw.plans.vectors import CLOSED, Arrow, End, Plan, round_up
from mechdae.draw.sheet import MILLIMETRE, Sheet, normal
from mechdae.errors import UnavailableError
from mechdae.records import dataclass

LONG = 12.0
"""Shorter forces have no name."""
SHARE = 0.3
"""The longest force takes up so much of the height of the picture."""


@dataclass(frozen=True)
class Applied:
    """A force [N] at the end of a turned velocity [m/s]."""

    gid: str
    kind: str
    place: Array
    force: Array
    text: str

    @property
    def power(self) -> float:
        """Moment about the pole [W]."""
        return float(self.place[0] * self.force[1] - self.place[1] * self.force[0])


@dataclass(frozen=True)
class Lever:
    """The turned velocity plan and the forces on it; ``lost`` is the power of friction [W]."""

    plan: Plan
    forces: tuple[Applied, ...]
    lost: float

    @property
    def size(self) -> float:
        """The largest power [W]."""
        return max((abs(entry.power) for entry in self.forces), default=0.0)

    @property
    def rest(self) -> float:
        """What the moments about the pole leave, friction's power taken off [W]."""
        return sum(entry.power for entry in self.forces) - self.lost


def turned(vector: Array) -> Array:
    """Return a vector turned clockwise by a right angle."""
    return np.array([vector[1], -vector[0]])


def lever(result: Any, scene: DrawnScene, pose: int) -> Lever:
    """Return Zhukovsky's lever of one pose."""
    plan = motion_plan(result, scene, pose, "velocity")
    arrows = tuple(
        Arrow(
            entry.gid.replace("velocity", "lever"),
            entry.kind,
            turned(entry.start),
            turned(entry.end),
        )
        for entry in plan.arrows
    )
    ends = tuple(
        End(e.gid.replace("velocity", "lever"), e.text, turned(e.place)) for e in plan.ends
    )
    sides = tuple((turned(a), turned(b)) for a, b in plan.sides)
    whole = Plan("lever", "Zhukovsky's lever", "v", "m/s", arrows, ends, sides, gap=plan.gap)
    balance = BodyForces(result, scene, pose)
    wheels = [j.name for j in scene.mechanism.joints.values() if j.meshes]
    if wheels:
        raise UnavailableError(
            f"Zhukovsky's lever is not drawn of mechanisms with wheels (joint {wheels[0]})"
        )
    forces = [entry for body in scene.mechanism.bodies for entry in _on(balance, body)]
    lost = 0.0
    if getattr(result.definition, "friction", "") == "coupled":
        losses = [s["loss"][pose] for s in result.joints.values() if "loss" in s]
        lost = float(np.nansum(losses)) if losses else 0.0
    return Lever(whole, tuple(forces), lost)


def _on(balance: BodyForces, body: str) -> Iterator[Applied]:
    """Yield what acts on a body from outside the mechanism, and of inertia, on the lever."""
    if not balance.rates.has(body, "acceleration"):
        return
    mark = balance.numbers[body]

    def put(kind: str, place: Array, force: Array, letter: str) -> Iterator[Applied]:
        if np.isfinite(force).all() and force.any():
            image = turned(balance.rates.at(body, place, "velocity"))
            text = rf"\mathbf{{{letter}}}_{{{mark}}}"
            yield Applied(f"lever-{kind}-{body}", kind, image, force, text)

    centre = balance.centre(body)
    yield from put("weight", centre, balance.weight(body), "G")
    yield from put("inertia", centre, balance.inertia(body), r"\Phi")
    yield from _couple(balance, body, "inertia", "couple", balance.couple(body), "M")
    for _, place, force in balance.pushes(body):
        yield from put("drive", place, force, "F")
    for text, torque in balance.twists(body).items():
        yield from _couple(balance, body, "drive", text, torque, "F")
    if body in balance.loaded or body in balance.turned:
        force, moment = balance.load(body)
        at = _acting(balance, body, force, moment)
        if body in balance.loaded:
            yield from put("load", at, force, "P")
        if body in balance.turned:
            yield from _couple(balance, body, "load", "torque", moment, "P")


def _acting(balance: BodyForces, body: str, force: Array, moment: float) -> Array:
    """Return the point of a body nearest to its origin that its load acts through."""
    origin = np.array(balance.scene.origins[body][balance.pose])
    size = float(force @ force)
    if not size or body in balance.turned:
        return origin
    return origin + np.array([force[1], -force[0]]) * moment / size


def _couple(
    balance: BodyForces, body: str, kind: str, word: str, moment: float, letter: str
) -> Iterator[Applied]:
    """Yield a couple on a body as two forces at the images of two of its points."""
    spin = balance.rates.spins[body][0]
    points = [f"{body}.{name}" for name in balance.scene.mechanism.bodies[body].points]
    if not spin or not moment or not np.isfinite(moment):
        return
    first = balance.rates.place(points[0])
    second = max(
        (balance.rates.place(entry) for entry in points),
        key=lambda place: round(float(np.hypot(*(place - first))), 12),
    )
    if not (second - first).any():  # a link with one point: any other one will do
        second = first + np.array([0.1, 0.0])
    arm = second - first
    force = moment * normal(arm) / float(arm @ arm)
    text = rf"\mathbf{{{letter}}}_{{{balance.numbers[body]}}}"
    for place, sign, end in ((first, -1.0, "start"), (second, 1.0, "end")):
        image = turned(balance.rates.at(body, place, "velocity"))
        yield Applied(f"lever-{kind}-{body}-{word}-{end}", kind, image, sign * force, text)


def draw_lever(ax: Axes, drawn: Lever, scale: float | None = None) -> Sheet:
    """Draw a lever: the turned plan to the scale of velocities, forces to one of their own."""
    plan = drawn.plan
    places = plan.corners
    low, high = places.min(axis=0), places.max(axis=0)
    if scale is None:
        scale = round_up(smallest(ax, low, high) / (1 - SHARE)) if plan.size > 0 else 1.0
    sheet = Sheet(ax, low, high, scale)
    sizes = [float(np.hypot(*entry.force)) for entry in drawn.forces]
    room = SHARE * float(sheet.size[1]) * sheet.k / MILLIMETRE
    force_scale = round_up(max(sizes) / room) if sizes else 1.0
    forces = [
        Arrow(
            entry.gid,
            entry.kind,
            entry.place,
            entry.place + entry.force / force_scale * scale,
            entry.text,
        )
        for entry in drawn.forces
    ]
    places = np.array([*places, *(arrow.end for arrow in forces)])
    sheet = Sheet(ax, places.min(axis=0), places.max(axis=0), scale)
    draw_vectors(sheet, plan)
    for arrow in forces:
        draw_arrow(sheet, arrow)
    heading(sheet, plan.title, "lever-title")
    texts = [scale_text("v", scale, "m/s"), scale_text("F", force_scale, "N")]
    caption(sheet, ",  ".join(texts), "lever-scale")
    _moments(sheet, drawn)
    write(
        sheet,
        plan.ends,
        plan.arrows,
        [arrow for arrow in forces if sheet.metre * arrow.length > LONG],
    )
    return sheet


def _moments(sheet: Sheet, drawn: Lever) -> None:
    """List the moments about the pole, which are powers, at the right."""
    powers: dict[str, float] = {}
    for entry in drawn.forces:
        powers[entry.text] = powers.get(entry.text, 0.0) + entry.power
    rows = [
        f"${text}$: {_watts(power)}"
        for text, power in powers.items()
        if abs(power) > CLOSED * drawn.size
    ]
    if drawn.lost:
        rows.append(f"friction: {_watts(-drawn.lost)}")
    rows.append(f"sum: {_watts(drawn.rest if abs(drawn.rest) > CLOSED * drawn.size else 0.0)}")
    chosen = font(11.0)
    right = float(sheet.size[0]) - 4.0
    for k, row in enumerate(rows):
        low, high = ink(row, chosen)
        width, spot = float((high - low)[0]), float(sheet.size[1]) - 10.0 - 15.0 * k
        sheet.text(np.array([right - width / 2, spot]), row, chosen, style.INK, f"lever-moment-{k}")
        sheet.box((right - width - 4.0, spot - 8.0), (sheet.size[0], spot + 8.0))


def _watts(power: float) -> str:
    return f"{power:.6g} W".replace("-", "\N{MINUS SIGN}")
