"""Arcs of angles with their letters on a diagram: of links to the x axis, and of joints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.places import numbers_of
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.labels.labels import Writing, letter
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, arc
from mechdae.errors import InputError, UnknownName
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json

ALL = "all"
GREEK = dict(
    zip(
        "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau "
        "upsilon phi chi psi omega".split(),
        "αβγδεζηθικλμνξπρστυφχψω",
        strict=True,
    )
)
"""Letters by the names that files have for them."""
RADIUS, STEP = 27.0, 11.0
"""Radius of an arc, and how much larger the next one about the same place is."""
BEYOND = 9.0
"""How far a side that is no bar goes beyond its arc."""
STILL = 1e-9
"""Links along x have no arc [rad/2]."""
NEAR = 1.0
"""Places are one that are not farther from each other [units]."""


@dataclass(frozen=True)
class Angle:
    """An angle: its letter, its corner, and the directions that it is between [rad]."""

    name: str
    corner: Array
    start: float
    turn: float


def draw_angles(sheet: Sheet, scene: DrawnScene, pose: int, wanted: Sequence[str]) -> list[Writing]:
    """Draw arcs of the angles that are asked for, see `angles_of`; return their letters."""
    corners: list[Array] = []
    texts = []
    for marked in angles_of(scene, pose, wanted):
        center = sheet.at(marked.corner)
        times = sum(float(np.hypot(*(center - other))) < NEAR for other in corners)
        corners.append(center)
        radius, gid = RADIUS + STEP * times, f"angle-{marked.name}"
        for direction in (marked.start, marked.start + marked.turn):
            ray = np.array([np.cos(direction), np.sin(direction)])
            sheet.line([center, center + (radius + BEYOND) * ray], color=style.FAINT,
                       width=style.THIN, dash=style.DASHED, gid=f"{gid}-side",
                       z=style.Z_GHOST, weight=style.RING)  # fmt: skip
        points = arc(center, radius, marked.start, marked.start + marked.turn)
        sheet.line(points, color=style.LOAD, width=style.THIN, gid=gid)
        head = min(6.0, 0.5 * float(np.hypot(*np.diff(points, axis=0).T).sum()))
        symbols.tip(sheet, points[-3], points[-1], style.LOAD, size=(head, 0.33 * head))
        middle = marked.start + marked.turn / 2
        out = np.array([np.cos(middle), np.sin(middle)])
        texts.append(letter(marked.name, gid, center + radius * out, 2.0, [-out]))
    return texts


def angles_of(scene: DrawnScene, pose: int, wanted: Sequence[str]) -> Iterator[Angle]:
    """Yield the angles of a pose.

    ``wanted`` are names of links and coordinates such as ``rod.angle``, each with a letter where
    it is to be another one than that of explanations or of the file's outputs:
    ``psi=rod.angle``; ``all`` are those of all links but of such as lie along x.

    Raises
    ------
    UnknownName
        No such coordinate.
    InputError
        A coordinate that is no angle, or of a link that is not drawn.
    """
    texts = [text for text in wanted if text != ALL]
    if ALL in wanted:
        named = {text.partition("=")[2] or text for text in texts}
        every = [
            body
            for body in scene.mechanism.bodies
            if scene.shown(body, pose) and abs(np.sin(scene.angles[body][pose] / 2)) > STILL
        ]
        texts += [body for body in every if not {body, f"{body}.angle"} & named]
    for text in texts:
        name, _, rest = text.rpartition("=")
        entry = _coordinate(scene, rest.strip())
        mechanism = scene.mechanism
        if entry.part in mechanism.bodies:
            base, body = 0.0, entry.part
            points = mechanism.bodies[body].points
            here = next((p for p in points if not scene.local(f"{body}.{p}").any()), None)
            corner = scene.place(f"{body}.{here}", pose) if here else scene.origins[body][pose]
        else:
            joint = mechanism.joints[entry.part]
            base, body = float(scene.angles[joint.first_body][pose]), joint.second_body
            corner = scene.place(joint.second, pose)
        if not scene.shown(body, pose):
            raise InputError(f"{body} is not drawn in pose {pose}", where=f"angles: {text}")
        turn = float(scene.angles[body][pose]) - base
        turn = np.pi - (np.pi - turn) % (2 * np.pi)
        yield Angle(_letter(scene, entry, name.strip()), corner, base, turn)


def _coordinate(scene: DrawnScene, text: str) -> NamedCoordinate:
    whole = text if "." in text else f"{text}.angle"
    try:
        entry = coordinate(scene.mechanism, whole)
    except UnknownName as problem:
        raise problem.inside("angles") from None
    if not entry.is_angle:
        raise InputError(f"{text} is no angle", where="angles", hint="rod.angle, or all")
    return entry


def _letter(scene: DrawnScene, entry: NamedCoordinate, given: str) -> str:
    """Return the letter given, that of an output of the file, or that of explanations."""
    outputs: Json = dict(scene.mechanism.outputs)
    name = given or next((key for key, text in outputs.items() if text == entry.text), "")
    if not name and entry.part in scene.mechanism.bodies:
        name = f"φ{numbers_of(scene.mechanism)[entry.part]}"
    stem = (name or f"θ{entry.part}").rstrip("0123456789_")
    return GREEK.get(stem, stem) + (name or stem)[len(stem) :]
