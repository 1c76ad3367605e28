"""Zhukovsky's lever: the velocity plan turned by a right angle as a lever about its pole.

Every force is put, as it is, at the end of the turned velocity of the point it acts at; its
moment about the pole is then its power, and all moments together vanish. A couple is two
forces at the images of two points of its link, so is the balancing torque of the driver. The
plan is turned clockwise, so that counter-clockwise moments are positive powers.

Friction circles: the reaction of a pin with friction passes its centre at the radius
rho = r sin(arctan f), on the side on which its moment opposes the turning.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.formulas.notations import written_letter
from mechdae.draw.graphs.scale import number
from mechdae.draw.plans.board import (
    CLOSED,
    Arrow,
    End,
    Plan,
    caption,
    draw_arrow,
    draw_vectors,
    heading,
    round_up,
    scale_text,
    smallest,
    write,
    write_line,
)
from mechdae.draw.plans.forces import BodyForces
from mechdae.draw.plans.relations import motion_plan
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import MILLIMETRE, Sheet, arc, normal, unit
from mechdae.errors import UnavailableError
from mechdae.records import dataclass

LONG = 12.0
"""Shorter forces have no name."""
SHARE = 0.3
"""The longest force takes up so much of the height of the picture."""


@dataclass(frozen=True)
class Lever:
    """The turned velocity plan and what acts on it; ``lost`` is the power of friction [W].

    Forces [N] begin at the ends of turned velocities [m/s]: their moments are powers.
    """

    plan: Plan
    forces: tuple[Arrow, ...]
    lost: float

    @property
    def size(self) -> float:
        """The largest power [W]."""
        return max((abs(force.moment) for force in self.forces), default=0.0)

    @property
    def rest(self) -> float:
        """What the moments about the pole leave, friction's power taken off [W]."""
        return sum(force.moment for force in self.forces) - self.lost


def turned(vector: Array) -> Array:
    """Return a vector turned clockwise by a right angle."""
    return -normal(vector)


def lever(result: Any, scene: DrawnScene, pose: int) -> Lever:
    """Return Zhukovsky's lever of one pose."""
    wheels = [joint.name for joint in scene.mechanism.joints.values() if joint.meshes]
    if wheels:
        raise UnavailableError(
            f"Zhukovsky's lever is not drawn of mechanisms with wheels (joint {wheels[0]})"
        )
    plan = motion_plan(result, scene, pose, "velocity")

    def gid(part: Arrow | End) -> str:
        return part.gid.replace("velocity", "lever")

    whole = replace(
        plan,
        word="lever",
        title="Zhukovsky's lever",
        arrows=tuple(Arrow(gid(a), a.kind, turned(a.start), turned(a.end)) for a in plan.arrows),
        ends=tuple(End(gid(end), end.text, turned(end.place)) for end in plan.ends),
        sides=tuple((turned(a), turned(b)) for a, b in plan.sides),
        relations=(),
    )
    balance = BodyForces(result, scene, pose)
    forces = [force for body in scene.mechanism.bodies for force in _on(balance, body)]
    lost = 0.0
    if getattr(result.definition, "friction", "") == "coupled":
        lost = float(np.nansum([s["loss"][pose] for s in result.joints.values() if "loss" in s]))
    return Lever(whole, tuple(forces), lost)


def _on(balance: BodyForces, body: str) -> Iterator[Arrow]:
    """Yield what acts on a body from outside the mechanism, and of inertia, on the lever."""
    if not balance.rates.has(body, "acceleration"):
        return
    mark = balance.numbers[body]

    def put(kind: str, place: Array, force: Array, letter: str) -> Iterator[Arrow]:
        if np.isfinite(force).all() and force.any():
            image = turned(balance.rates.at(body, place, "velocity"))
            text = rf"\mathbf{{{letter}}}_{{{mark}}}"
            yield Arrow(f"lever-{kind}-{body}", kind, image, image + force, text)

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
    return origin + turned(force) * moment / size


def _couple(
    balance: BodyForces, body: str, kind: str, word: str, moment: float, letter: str
) -> Iterator[Arrow]:
    """Yield a couple on a body as two forces at the images of two of its points."""
    spin = balance.rates.spins[body][0]
    points = balance.scene.points(body)
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
        gid = f"lever-{kind}-{body}-{word}-{end}"
        yield Arrow(gid, kind, image, image + sign * force, text)


def draw_lever(ax: Axes, drawn: Lever, scale: float | None = None) -> Sheet:
    """Draw a lever: the turned plan to the scale of velocities, forces to one of their own."""
    plan, places = drawn.plan, drawn.plan.corners
    low, high = places.min(axis=0), places.max(axis=0)
    if scale is None:
        scale = round_up(smallest(ax, low, high) / (1 - SHARE)) if plan.size > 0 else 1.0
    sheet = Sheet(ax, low, high, scale)
    room = SHARE * float(sheet.size[1]) * sheet.k / MILLIMETRE
    largest = max((force.length for force in drawn.forces), default=0.0)
    force_scale = round_up(largest / room) if largest else 1.0
    forces = [
        replace(force, end=force.start + force.vector / force_scale * scale)
        for force in drawn.forces
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
    tipped = [arrow for arrow in forces if sheet.metre * arrow.length > LONG]
    write(sheet, plan.ends, plan.arrows, tipped)
    return sheet


def _moments(sheet: Sheet, drawn: Lever) -> None:
    """List the moments about the pole, which are powers, at the right."""
    powers: defaultdict[str, float] = defaultdict(float)
    for force in drawn.forces:
        powers[f"${force.text}$"] += force.moment
    rows = {text: power for text, power in powers.items() if abs(power) > CLOSED * drawn.size}
    rows |= {"friction": -drawn.lost} if drawn.lost else {}
    rows["sum"] = drawn.rest if abs(drawn.rest) > CLOSED * drawn.size else 0.0
    for k, (text, power) in enumerate(rows.items()):
        y, gid = float(sheet.size[1]) - 10.0 - 15.0 * k, f"lever-moment-{k}"
        line = f"{text}: {number(power, 6)} W"
        write_line(sheet, line, gid, y, style.INK, right=True, families=style.FONT)


NEAR = 3.0
"""A pin is drawn so far around its friction circle, in radii of that."""


@dataclass(frozen=True)
class Pin:
    """A pin with friction in one pose.

    Parameters
    ----------
    joint
        Its name.
    centre
        Its place [m].
    pin_radius, radius
        Of the pin and of its friction circle [m].
    force
        Of the first body on the second [N].
    foot
        The point of its line of action nearest to the centre, seen from there [m].
    spin
        Angular velocity of the second body less that of the first [rad/s].
    text
        Name of the force in mathtext.
    """

    joint: str
    centre: Array
    pin_radius: float
    radius: float
    force: Array
    foot: Array
    spin: float
    text: str


def pins_of(result: Any, scene: DrawnScene, pose: int) -> list[Pin]:
    """Return the pins with friction whose reaction is known in that pose and not zero."""
    balance, found = BodyForces(result, scene, pose), []
    plain = getattr(result.definition, "friction_radius", "") == "article"
    for joint in scene.mechanism.joints.values():
        f = scene.numbers.get(f"{joint.name}.friction", 0.0)
        series = result.joints.get(joint.name) or {}
        if not joint.hinge or not f or "reaction" not in series:
            continue
        x, y, moment = (float(entry) for entry in series["reaction"][pose])
        force = np.array([x, y])
        if not np.isfinite([x, y, moment]).all() or not force.any():
            continue
        r = scene.numbers[f"{joint.name}.pin_radius"]
        spins = [balance.rates.spins.get(body, (np.nan, 0.0))[0] for body in joint.bodies[:2]]
        found.append(
            Pin(
                joint.name,
                scene.place(joint.second, pose),
                r,
                r * f if plain else r * f / float(np.sqrt(1 + f * f)),
                force,
                -normal(force) * moment / float(force @ force),
                spins[1] - spins[0],
                balance.name(joint.name, joint.second_body),
            )
        )
    return found


def draw_lines(sheet: Sheet, pins: list[Pin]) -> str:
    """Draw friction circles and lines of action over the links of a diagram, to its scale."""
    reach, sizes = 0.06 * float(sheet.size[0]), [float(np.hypot(*pin.force)) for pin in pins]
    for pin, size in zip(pins, sizes, strict=True):
        through, gid = sheet.at(pin.centre + pin.foot), f"friction-line-{pin.joint}"
        half = reach * (0.5 + size / max(sizes)) * unit(pin.force)
        ends = [through - half, through + half]
        sheet.line(ends, color=style.ARROW, dash=style.DASH_DOT, z=style.Z_PIN, gid=gid)
        centre, gid = sheet.at(pin.centre), f"friction-circle-{pin.joint}"
        sheet.circle(centre, pin.radius * sheet.metre, edge=style.WHEEL, z=style.Z_LABEL, gid=gid)
    return ""


def draw_pin(ax: Axes, pin: Pin, force_scale: float) -> Sheet:
    """Draw one pin enlarged: its surface, its friction circle and the reaction that touches it."""
    span = min(1.25 * pin.pin_radius, NEAR * pin.radius)
    low, high = np.full(2, -span), np.full(2, span)
    scale = round_up(smallest(ax, low, high))
    sheet = Sheet(ax, low, high, scale)
    middle = sheet.at((0.0, 0.0))
    gid = f"friction-{pin.joint}"
    if pin.pin_radius < span:
        surface = pin.pin_radius * sheet.metre
        sheet.circle(middle, surface, edge=style.FAINT, gid=f"{gid}-pin", weight=style.RING)
    sheet.circle(middle, pin.radius * sheet.metre, edge=style.WHEEL, width=1.5, gid=f"{gid}-circle")
    symbols.dot(sheet, middle, f"{gid}-centre")
    along, foot = unit(pin.force), sheet.at(pin.foot)
    far = 1.2 * span * sheet.metre
    ends, dash = [foot - far * along, foot + far * along], style.DASH_DOT
    sheet.line(ends, color=style.ARROW, width=style.THIN, dash=dash, gid=f"{gid}-line")
    # forces have a scale of their own: the arrow is as long as they say
    end = pin.foot + pin.force / force_scale * scale
    arrow = Arrow(f"{gid}-force", "reaction", pin.foot, end, pin.text)
    draw_arrow(sheet, arrow)
    sense = float(np.sign(pin.spin))
    if sense:
        start = float(np.arctan2(along[1], along[0])) + np.pi
        turn = arc(middle, 0.7 * span * sheet.metre, start - 0.6 * sense, start + 0.6 * sense)
        symbols.arrow(sheet, turn, f"{gid}-turning", style.DRIVEN)
    sizes = rf"$r$ = {1000 * pin.pin_radius:.4g} mm,  $\rho$ = {1000 * pin.radius:.4g} mm"
    heading(sheet, f"Pin ${written_letter(pin.joint)}$,  {sizes}", f"{gid}-title")
    text = f"{scale_text('l', scale, 'm')},  {scale_text('F', force_scale, 'N')}"
    caption(sheet, text, f"{gid}-scale")
    write(sheet, (), (arrow,))
    return sheet


def force_scale_of(axes: list[Axes], pins: list[Pin]) -> float:
    """Return a round scale at which every reaction is shorter than two fifths of its panel."""
    found = []
    for ax, pin in zip(axes, pins, strict=True):
        sheet = Sheet(ax, (0.0, 0.0), (1.0, 1.0))
        room = float(sheet.size.min()) * sheet.k / 72 * 25.4 / 2.5
        found.append(float(np.hypot(*pin.force)) / room)
    return round_up(max(found))
