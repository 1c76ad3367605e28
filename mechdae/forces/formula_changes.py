"""Where a formula of forces changes along a path, and the arcs that jam or lock themselves.

Signs of sliding speeds, pieces of tables and of friction laws, numbers of solutions are whole
numbers that change at kinks. They are compared between neighbours on a grid, and where they
differ in ever shorter intervals.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.forces.inverse_dynamics import InverseDynamics, LoadedPoses
from mechdae.forces.poses import Moving, PoseForces, solved
from mechdae.kernels.graphs.kinetostatics import SPEEDS
from mechdae.numerics.changes import Guide, arcs_of, changes
from mechdae.types import Booleans, Floats, Integers

SAMPLES = 512
"""Intervals in which kinks are looked for, at least."""
CLOSE = 2 * SAMPLES
"""Poses that lie so close that nothing is looked for between them."""
ROUNDING = 1e-12
"""Share of the losses, or of what goes in and out, that a power has to reach to have a sign."""
FLAGS = ("jammed", "ambiguous", "locking")


def fastest(statics: InverseDynamics, motion: LoadedPoses) -> float:
    """Return the largest speed at poses [m/s], of angles by a length of the mechanism."""
    slipping = statics.batch("slipping", lambda: statics.balance.slipping, SPEEDS)
    turning, moving = np.nan_to_num(slipping(motion.w, motion.v, statics.p)[1]).T
    return float(np.maximum(moving, turning * statics.length).max(initial=0.0))


class State:
    """What decides which formula holds at a place of the path: signs, pieces, solutions."""

    def __init__(self, statics: InverseDynamics, moving: Moving) -> None:
        self.statics: InverseDynamics = statics
        self.moving: Moving = moving

    def at(self, s: Floats, coupled: bool = True) -> PoseForces:
        """Return the forces at places; all solutions if friction is `coupled`."""
        motion = self.moving.at(s)
        return solved(self.statics, motion, motion.there & coupled, critical=False)

    def powers(self, here: PoseForces, coupled: bool) -> Floats:
        """Return powers: driver without friction, with it, losses of both."""
        free = here.free
        whole = here.whole if coupled else free
        driven = [loaded.driven(here.motion)[:, None] for loaded in (free, whole)]
        return np.hstack([*driven, free.losses, whole.losses])

    # -- what changes at kinks -------------------------------------------------------------

    def marks(self, here: PoseForces) -> tuple[Integers, Floats, list[Guide]]:
        """Return whole numbers (n, k) that change where a formula does, and what guides to it.

        The first tell whether a pose is jammed, has several solutions, locks itself; the next
        whether it is there at all. Others have a guide among continuous numbers (n, m).
        """
        statics, signs = self.statics, np.nan_to_num(here.inputs[5])
        jammed = here.jammed
        flags = [jammed, here.ambiguous, self._locking(here), ~here.motion.there]
        columns = [flag[:, None] for flag in flags]
        guides: list[Guide] = [("slow", slice(0))] * 2 + [("", slice(0))] * 2
        values: list[Floats] = []

        def add(kind: str, mark: Any, guide: Floats) -> None:
            start = sum(part.shape[1] for part in values)
            columns.append(mark[:, None])
            values.append(guide)
            guides.append((kind, slice(start, start + guide.shape[1])))

        for sign, speed in zip(signs.T, statics.speeds(here.motion).T, strict=True):
            add("sign", sign, speed[:, None])
        for cell, at_and_start in statics.cells(here.motion):
            add("cell", cell, at_and_start)
        for stage in statics.staged(here.inputs, here.sizes) if statics.coupled else ():
            for law, forms in zip(stage.laws, stage.forms(np.nan_to_num(here.sizes)), strict=True):
                if law == "largest":
                    add(law, np.where(jammed, 0, np.argmax(forms, axis=1)), forms)
        return (
            np.hstack(columns).astype(int),
            np.hstack([np.zeros((len(jammed), 0)), *values]),
            guides,
        )

    def _locking(self, here: PoseForces) -> Booleans:
        """Return where loads push along the motion and friction holds it back nevertheless."""
        motion, locking = here.motion, np.zeros(len(here.counts), bool)
        if here.coupled:
            with np.errstate(invalid="ignore"):
                least = ROUNDING * here.whole.losses.sum(axis=1)
                locking = (here.free.driven(motion) < -least) & (here.whole.driven(motion) >= 0)
                locking &= ~here.jammed
                if locking.any():
                    locking &= self.statics.powers(here.inputs)[0] > least
        return locking


def on_grid(
    state: State, answer: PoseForces
) -> tuple[Floats, Integers, Floats, list[Guide], list[Floats]]:
    """Return places, their marks with guides, and powers without coupling and with it.

    The poses of the run are among the places where all of them are there.
    """
    ends = np.asarray(state.moving.run.places, float)
    parts = -(-SAMPLES // max(len(ends) - 1, 1))
    known = bool(answer.there.all()) and len(ends) > 1
    if known:
        parts = max(parts, 1 if len(ends) > CLOSE else 2)
        way = np.diff(ends)[:, None] * np.arange(1, parts) / parts
        inner = (ends[:-1, None] + way).ravel()
    else:
        inner = np.linspace(ends.min(), ends.max(), max(SAMPLES + 1, 2 * len(ends)))
    every = [*([state.at(inner)] if inner.size else []), *([answer] if known else [])]
    places = np.concatenate([inner, *([ends] if known else [])])
    order = np.argsort(places, kind="stable")
    seen = [state.marks(here) for here in every]
    marks, values = (np.concatenate([part[k] for part in seen])[order] for k in (0, 1))
    powers = [np.concatenate([state.powers(here, c) for here in every]) for c in (False, True)]
    return places[order], marks, values, seen[0][2], powers


def kinks_of(state: State, answer: PoseForces) -> tuple[list[float], dict[str, Any], list[Floats]]:
    """Return the places where a formula changes, the arcs by flag, and powers on a grid."""
    grid, marks, values, guides, powers = on_grid(state, answer)
    found = changes(grid, marks, values, guides, lambda places: state.marks(state.at(places))[:2])
    arcs = {name: arcs_of(column, marks, found, grid) for column, name in enumerate(FLAGS)}
    return _distinct([place for place, _, _ in found]), arcs, powers


def _distinct(places: list[float]) -> list[float]:
    """Return sorted places without repetitions within rounding."""
    distinct: list[float] = []
    for place in places:
        if not distinct or place - distinct[-1] > 1e-13 * max(abs(place), 1.0):
            distinct.append(place)
    return distinct
