"""How loads act along a motion, by which a page moves the arrows that were drawn of one pose."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.loads import Force, Load, Resistance, Spring
from mechdae.draw import style
from mechdae.draw.diagram.amounts import load_values, pushing
from mechdae.draw.diagram.loads import turns
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.primitives import Array
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.results import SweepResult


VARIES = 1e-9
"""A size that changes less than this share of it is one."""
STATES = 60
"""Poses at which pages know how loads act."""


def load_states(
    scene: PlacedScene, result: SweepResult, pose: int, known: Sequence[int], peak: float,
    ends_of: Callable[[str], Array | None],
) -> Json:  # fmt: skip
    """Return by load how its arrow differs from that drawn, ``known`` being along the way.

    ``rows``: how it is turned, share, -1 where it is turned round. Forces of the plane are turned
    by an angle [rad], those of space to a direction in their frame from ``from``. ``about``: the
    place that stays, ``across``: the direction across which it is turned round, else it is turned
    by a half turn. Torques of space turn from ``axis`` to a direction in their frame. ``varies``:
    whether the size does. ``sense``: of the arrow drawn, along the coordinate. ``along``: whether
    it is along a coordinate. ``ends_of`` gives start and tip of an arrow in the frame it is in.
    """
    states: Json = {}
    picks = [known[k] for k in np.linspace(0, len(known) - 1, STATES).round().astype(int)]
    for load in scene.mechanism.loads.values():
        ends = None if isinstance(load, Spring) else ends_of(f"load-{load.name}")
        if ends is None:
            continue
        force, flat = isinstance(load, Force), scene.mechanism.dimension == 2
        turned = turns(scene, load)
        values = np.array([
            _acting(scene, result, load, k, ends.shape[1] if force else 1) for k in (pose, *picks)
        ])  # fmt: skip
        vector = not flat and values.shape[1] > 1
        sizes = np.linalg.norm(values, axis=1)
        long = np.maximum(style.PULL[0], style.PULL[1] * sizes / peak) * (sizes > 0)
        shares = 1.0 * (sizes > 0) if turned else long / (long[0] or style.PULL[0])
        ways = np.ones(len(values)) if force or vector else np.where(values[:, 0] < 0, -1.0, 1.0)
        turn = np.zeros((len(values), 3 if vector else 1))
        if force and flat:
            angles = np.arctan2(values[:, 1], values[:, 0])
            turn[:, 0] = angles - angles[0]
        elif vector:
            turn = values / np.maximum(sizes, 1e-300)[:, None]
        rows = np.column_stack([turn, shares, ways * ways[0]])[1:].round(3) + 0.0
        varies = bool(np.ptp(sizes) > VARIES * sizes.max())
        same = (rows[:, -2:] == 1.0).all() and (np.ptp(turn, axis=0) == 0.0).all() and not varies
        if isinstance(load, Resistance) or not same:
            chord = (ends[1] - ends[0]) / max(float(np.linalg.norm(ends[1] - ends[0])), 1e-12)
            held: Json = {"rows": rows.tolist(), "sense": ways[0], "along": not force}
            held |= {"varies": varies}
            if vector and not force:
                held |= {"axis": _way(turn[0])}
            held |= {"from": _way(chord)} if force else {"about": _way(ends.mean(axis=0))}
            states[load.name] = held | ({"across": _way(chord)} if turned else {})
    return states


def _way(way: Array) -> list[float]:
    """Return a way in a frame; in the plane y is down."""
    return [round(part, 4) + 0.0 for part in (way * (1, -1) if len(way) == 2 else way).tolist()]


def _acting(scene: PlacedScene, result: SweepResult, load: Load, pose: int, count: int) -> Array:
    """Return components of a force, or what acts along a coordinate; one where it is not known."""
    values = load_values(scene, result, load, pose)
    if isinstance(load, Resistance):
        way = pushing(scene, result, load, pose)
        return np.array([way * (values or (1.0,))[0]])
    return np.array(values or (1.0,) + (0.0,) * (count - 1))
