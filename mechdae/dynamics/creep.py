"""Smoothed dry friction: its slope speeds, and how fast a pair creeps that would stick.

Where the load that a pair has to hold is below its limit, tanh(v / v_s) = load / limit: it creeps
with v_s atanh(load / limit).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.numerics.roots import halved
from mechdae.types import Floats, Integers, Unknowns

RESTS = 10.0
"""Speed, over the slope speed, below which a pair is one that would stick."""
MOST = 64
"""States that are looked at."""
RANK = 1e-9


class Creep:
    """Measures the creep of the states of a motion with smoothed friction.

    ``found``: by joint or load: ``bound`` of the creeping speed, ``load``, ``limit``, ``unit``,
    ``time`` of the state at which they are the largest.
    """

    def __init__(self, setup: MotionProblem) -> None:
        self.setup, self.kernel = setup, setup.kernel
        self.slips = setup.released.rubbing.slips
        self.found: dict[str, dict[str, Any]] = {}
        k = self.kernel
        self._values = k.batch("sticking", lambda: k.sticking, ())
        self._rhs = k.batch("rhs", lambda: k.rhs, ())

    def look(self, t: Floats, x: Unknowns, v: Floats) -> None:
        """Look at states (n, .)."""
        for i in np.linspace(0, len(t) - 1, min(len(t), MOST)).astype(int).tolist():
            self._state(float(t[i]), x[i], v[i])

    def _state(self, t: float, x: Unknowns, v: Floats) -> None:
        k, count = self.kernel, len(self.slips)
        self.setup.pieces = self.setup.pieces_at(t)
        loose = self.setup.loose
        speeds = self._at(self._values, t, x, v, loose)[0]
        slow = np.flatnonzero(np.abs(speeds) <= RESTS * self.setup.widths)
        if not len(slow):
            return
        J, C = k.value("place", t, x, v, loose)[1], k.value("locking", t, x, v, loose)[0]
        basis = k.sizes[:, None] * self.setup.freedoms(J)
        along = C @ basis / self._units[:, None]
        slow = slow[np.linalg.norm(along[slow], axis=1) > RANK * np.abs(along).max(initial=0.0)]
        if len(slow) and np.linalg.matrix_rank(along[slow], RANK) == len(slow):
            signs = loose.copy()
            signs[count + slow] = 1.0
            _, _, held, low, high, _ = self._at(self._values, t, x, v, signs)
            for j in slow.tolist():
                limit = high[j] if held[j] >= 0 else -low[j]
                self._keep(j, t, abs(float(held[j])), float(limit))
        elif len(slow) and along.shape[1] == 1:
            self._together(t, x, basis[:, 0], slow)

    def _together(self, t: float, x: Unknowns, way: Floats, slow: Integers) -> None:
        """Keep the creep of pairs of one freedom: its speed leaves no acceleration."""
        loose = self.setup.loose
        way = way / np.linalg.norm(way / self.kernel.sizes)
        ahead = way / self.kernel.sizes**2

        def pushed(speed: float) -> float:
            return float(ahead @ self._at(self._rhs, t, x, speed * way, loose)[0])

        per = np.abs(self._at(self._values, t, x, way, loose)[0])[slow]
        top = RESTS * float(np.max(self.setup.widths[slow] / np.maximum(per, 1e-300)))
        if not (pushed(top) < 0 < pushed(-top)):
            return  # it slides
        _, high = halved(lambda speed: pushed(speed) > 0, -top, top)
        speeds, _, _, least, largest, _ = self._at(self._values, t, x, high * way, loose)
        for j in slow.tolist():
            limit = float(largest[j] if speeds[j] < 0 else -least[j])
            share = abs(float(np.tanh(speeds[j] / self.setup.widths[j])))
            self._keep(j, t, share * limit, limit)

    def _keep(self, j: int, t: float, load: float, limit: float) -> None:
        if not 0 <= load < limit:
            return
        slip = self.slips[j]
        bound = float(self.setup.widths[j] * np.arctanh(load / limit))
        known = self.found.get(slip.owner)
        if known is None or bound > known["bound"]:
            unit = "rad/s" if slip.unit == "rad" else "m/s"
            self.found[slip.owner] = {"bound": bound, "load": load, "limit": limit, "unit": unit,
                                      "time": t}  # fmt: skip

    @property
    def _units(self) -> Floats:
        return np.array([1.0 if s.unit == "rad" else self.setup.length for s in self.slips])

    def _at(self, function: Any, t: float, x: Unknowns, v: Floats, signs: Floats) -> list[Floats]:
        found = function(np.array([[t]]), x[None, :], v[None, :], signs[None, :])
        return [part[0] for part in found]

    def notes(self) -> list[str]:
        """Return what to say about it."""
        moment = {"rad/s": "N m", "m/s": "N"}
        return [
            f"smooth friction of {name} creeps at up to {top['bound']:.6g} {top['unit']} where it "
            f"would stick (load {top['load']:.6g} of {top['limit']:.6g} {moment[top['unit']]} at "
            f"t = {top['time']:.6g} s)"
            for name, top in self.found.items()
        ]
