"""The shapes of small motions around an equilibrium, as poses that can be drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.draw.closing import gaps
from mechdae.draw.diagram.scene import DrawnScene, read_scene
from mechdae.draw.primitives import Array
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.results import Named, Series
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.results import EquilibriumResult


TURN = 0.15
"""Largest turn of a link that is shown [rad]: motions are small."""
STIFF = 1e-3
"""Turn of a link that is as good as moving it by the size of the mechanism, to close it [rad]."""
ROUNDS = 4
TRAVEL = 0.12
"""Largest way of a point that is shown, as a share of the size of the mechanism."""
DECAY = 3.0
"""What does not swing is shown over so many of its time constants."""


def shape_of(result: EquilibriumResult, number: int) -> Json:
    """Return an entry of the modes of an equilibrium, 1 is the slowest.

    Raises
    ------
    InputError
        No small motions, or none of that number.
    """
    listed = result.summary.get("modes")
    if listed is None:
        raise InputError(
            "there are no shapes of small motions in this result",
            where=f"tasks.{result.task}",
            hint="linearise = true",
        )
    if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= len(listed):
        raise InputError(
            f"there is no shape {number}", where="shape",
            hint=f"a whole number from 1 to {len(listed)}" if listed else "nothing can move",
        )  # fmt: skip
    found: Json = listed[number - 1]
    return found


def swinging(result: EquilibriumResult, number: int, frames: int) -> EquilibriumResult:
    """Return a result whose poses are a small motion, enlarged; the last pose is the one at rest.

    A shape that swings is shown over one period without its damping; what does not swing goes
    back to rest, or away from it where it grows.
    """
    mode = shape_of(result, number)
    real, swing = mode["eigenvalue"]
    if swing:
        phases = np.exp(2j * np.pi * np.arange(frames) / frames)
    else:
        phases = np.exp(-DECAY * np.linspace(0.0, 1.0, frames))[:: -1 if real > 0 else 1] + 0j
    scene = read_scene(result)
    angles = {GROUND: np.zeros(frames + 1)}
    origins = {GROUND: np.zeros((frames + 1, 2))}
    size = enlargement(result, mode)
    for body in result.mechanism.bodies:
        z = {word: complex(*value) for word, value in mode["bodies"][body].items()}
        moved = {word: size * np.append((value * phases).real, 0.0) for word, value in z.items()}
        angles[body] = scene.angles[body][0] + moved["angle"]
        origins[body] = scene.origins[body][0] + np.stack([moved["x"], moved["y"]], axis=1)
    scene = closed(replace(scene, angles=angles, origins=origins, status=("ok",) * (frames + 1)))
    bodies = {body: Series({"angle": scene.angles[body]}) for body in result.mechanism.bodies}
    points = {
        f"{body}.{point}": Series({"position": scene.track(f"{body}.{point}")})
        for body, parts in result.mechanism.bodies.items()
        for point in parts.points
    }
    return replace(
        result,
        bodies=Named("body", bodies),
        points=Named("point", points),
        joints=Named("joint", {}),
        outputs=Named("output", {}),
        status=np.array(["ok"] * (frames + 1)),
    )


def closed(scene: DrawnScene) -> DrawnScene:
    """Return the poses with joints that close: links are moved, and turned where they have to be.

    Shapes are of first order: enlarged, joints would gape by the squares of the turns.
    """
    names, joints = list(scene.mechanism.bodies), list(scene.mechanism.joints.values())

    def moved(q: Array) -> DrawnScene:
        parts = dict(zip(names, np.split(q, len(names), axis=1), strict=True))
        angles = {name: part[:, 2] for name, part in parts.items()}
        origins = {name: part[:, :2] for name, part in parts.items()}
        return replace(
            scene, angles={**scene.angles, **angles}, origins={**scene.origins, **origins}
        )

    def off(q: Array) -> Array:
        return np.hstack([np.zeros((len(q), 1)), *(gap for _, gap in gaps(moved(q), joints))])

    q = np.hstack([part for n in names for part in (scene.origins[n], scene.angles[n][:, None])])
    spots = np.vstack([scene.origins[name] for name in names])
    size = float(np.ptp(spots, axis=0).max()) or 1.0
    units = np.tile([size, size, STIFF], len(names))
    step = 1e-6
    for _ in range(ROUNDS):
        ways = step * np.diag(units)
        slopes = np.stack([(off(q + way) - off(q - way)) / (2 * step) for way in ways], 2)
        rows = zip(slopes, off(q), strict=True)
        q = q - units * np.stack([np.linalg.lstsq(*row, rcond=1e-9)[0] for row in rows])
    return moved(q)


def enlargement(result: EquilibriumResult, mode: Json) -> float:
    """Return the factor on a shape with which it is seen."""
    scene = read_scene(result)
    turn, way, spots = 0.0, 0.0, []
    for body, parts in result.mechanism.bodies.items():
        z = {word: complex(*value) for word, value in mode["bodies"][body].items()}
        turn, origin = max(turn, abs(z["angle"])), scene.origins[body][0]
        places = [scene.place(f"{body}.{point}", 0) for point in parts.points] or [origin]
        for x, y in np.array(places) - origin:
            moved = abs(z["x"] - z["angle"] * y), abs(z["y"] + z["angle"] * x)
            way = max(way, float(np.hypot(*moved)))
        spots += places
    size = float(np.ptp(spots, axis=0).max()) or 1.0
    limits = [most / moved for most, moved in ((TURN, turn), (TRAVEL * size, way)) if moved]
    return min(limits, default=1.0)


def swing_text(result: EquilibriumResult, number: int, words: Words) -> str:
    """Return which shape it is, with frequency and damping."""
    mode = shape_of(result, number)
    parts = [str(result.task), words("shape of", number, len(result.summary["modes"]))]
    if mode["eigenvalue"][1]:
        parts.append(f"{words.number(mode['frequency'], 4)} {words('Hz')}")
        parts.append(words("damping", words.number(mode["damping"], 3)))
    else:
        parts.append(words("rate", words.number(mode["eigenvalue"][0], 4)))
    return "  ·  ".join([*parts, words("enlarged")])
