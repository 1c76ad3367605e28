"""Friction circles of pins, and the reactions that touch them.

The reaction of a pin with friction passes its centre at the radius of the friction circle,
rho = r sin(arctan f), on the side on which its moment opposes the turning.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.formulas.notations import written_letter
from mechdae.draw.plans.board import caption, draw_arrow, heading, scale_text, smallest, write
from mechdae.draw.plans.forces import BodyForces
from mechdae.draw.plans.vectors import Arrow, round_up
from mechdae.draw.sheet import Sheet, arc, normal, unit
from mechdae.records import dataclass

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


def draw_lines(ax: Axes, pins: list[Pin]) -> None:
    """Draw friction circles and lines of action into the diagram, to its scale."""
    width = float(np.ptp(ax.get_xlim()))
    reach = 0.06 * width
    lengths = np.array([float(np.hypot(*pin.force)) for pin in pins])
    for pin, share in zip(pins, lengths / lengths.max(initial=1.0), strict=True):
        along = unit(pin.force)
        through = pin.centre + pin.foot
        half = reach * (0.5 + share)
        ends = np.array([through - half * along, through + half * along])
        line = Line2D(
            *ends.T,
            color=style.ARROW,
            linewidth=style.LINE,
            linestyle=style.DASH_DOT,
            zorder=style.Z_PIN,
            gid=f"friction-line-{pin.joint}",
        )
        ax.add_line(line)
        ax.add_patch(
            Circle(
                tuple(pin.centre),
                pin.radius,
                facecolor="none",
                edgecolor=style.WHEEL,
                linewidth=style.LINE,
                zorder=style.Z_LABEL,
                gid=f"friction-circle-{pin.joint}",
            )
        )


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
    sheet.line(
        [foot - far * along, foot + far * along],
        color=style.ARROW,
        width=style.THIN,
        dash=style.DASH_DOT,
        gid=f"{gid}-line",
    )
    # forces have a scale of their own: the arrow is as long as they say
    end = pin.foot + pin.force / force_scale * scale
    arrow = Arrow(f"{gid}-force", "reaction", pin.foot, end, pin.text)
    draw_arrow(sheet, arrow)
    sense = float(np.sign(pin.spin))
    if sense:
        start = float(np.arctan2(along[1], along[0])) + np.pi
        radius = 0.7 * span * sheet.metre
        symbols.arrow(
            sheet,
            arc(middle, radius, start - 0.6 * sense, start + 0.6 * sense),
            f"{gid}-turning",
            style.DRIVEN,
        )
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
