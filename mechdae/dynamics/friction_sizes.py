"""Sizes of friction in joints: whether its laws give one solution, none or several; creep.

`Sizes` asks at a state, `Creep` measures smoothed friction: where the load that a pair has to hold
is below its limit, tanh(v / v_s) = load / limit, it creeps with v_s atanh(load / limit).

Sizes follow from reactions, which follow from them. Where a bound of how they change each other is
below 1 there is one solution; else they are counted.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import NoWay
from mechdae.equations.forces.feedback import ACROSS
from mechdae.forces.friction_solutions import SAME, apart, solutions_of
from mechdae.kernels.run.functions import without_repeats
from mechdae.numerics.roots import halved
from mechdae.types import Floats, Graph, Integers, Matrices, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.forces.feedback import Slip
    from mechdae.forces.one_sided.lift_off import HoldingContacts
    from mechdae.kernels.graphs.equations_of_motion import Kernel

RESTS = 10.0
"""Speed, over the slope speed, below which a pair is one that would stick."""
MOST = 64
"""States that are looked at."""
RANK = 1e-9
LEAST = 1e-150


class Creep:
    """Measures the creep of the states of a motion with smoothed friction.

    ``found``: by joint or load: ``bound`` of the creeping speed, ``load``, ``limit``, ``unit``,
    ``time`` of the state at which they are the largest.
    """

    def __init__(self, setup: MotionProblem) -> None:
        self.setup, self.kernel = setup, setup.kernel
        self.slips: list[Slip] = setup.released.rubbing.slips
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
        speeds = self._at(self._values, t, x, v, loose)[0][:count]
        slow = np.flatnonzero(np.abs(speeds) <= RESTS * self.setup.widths)
        if not len(slow):
            return
        J, C = k.value("place", t, x, v, loose)[1], k.value("locking", t, x, v, loose)[0]
        basis = k.sizes[:, None] * self.setup.freedoms(J)
        along = C[:count] @ basis / self._units[:, None]
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


def pressing(k: Kernel) -> Any:
    """Return the batch (t, x, v, signs) -> sizes of friction of a kernel, and forms they are of."""

    def build() -> Graph:
        _, starts, slopes = k.coupling(*k.inputs)
        _, inner, _ = k.coupled(*k.inputs)
        sizes = inner[k.m + k.slips :]
        results = [ca.densify(sizes), ca.densify(starts + slopes @ sizes)]
        return ca.Function("pressing", k.inputs, results)

    return k.batch("pressing", build)


class Sizes:
    """Counts the sizes of friction that fit their laws at states of a motion.

    ``started``: slips that began to move from rest where one of several solutions fits that: it is
    followed while they move on. ``notes``: by the rules that ruled solutions out, what to say of
    the first time.
    """

    def __init__(self, setup: MotionProblem) -> None:
        self.setup: MotionProblem = setup
        self.kernel: Kernel = setup.kernel
        self.started: set[int] = set()
        self.notes: dict[tuple[str, ...], str] = {}

    @cached_property
    def _contacts(self) -> list[HoldingContacts]:
        return [make(self.setup) for make in self.setup.model.cases("holding contacts")]

    @cached_property
    def _rates(self) -> Any:
        return self.kernel.batch("rhs", lambda: self.kernel.rhs)

    @cached_property
    def _coupling(self) -> Any:
        k = self.kernel

        def build() -> Graph:
            columns, starts, slopes = k.coupling(*k.inputs)
            results = [ca.vec(columns), starts, ca.vec(slopes)]
            return without_repeats("coupling", k.inputs, results)

        return k.batch("coupling", build)

    def _growths(
        self, t: Floats | float, x: Unknowns, v: Floats, signs: Floats
    ) -> tuple[Matrices, Floats]:
        """Return (n, k, k) bounds of how sizes change each other, and weights (n, k) of them."""
        _, _, slopes = self._coupling(np.reshape(t, (-1, 1)), np.atleast_2d(x), np.atleast_2d(v),
                                      signs)  # fmt: skip
        n, rubs = len(slopes), self.kernel.rubs
        slopes = slopes.reshape(n, rubs, -1).transpose(0, 2, 1)
        K = np.empty((n, rubs, rubs))
        forms: Any = None
        if any(law in ACROSS for law in self._laws):
            at = np.reshape(t, (-1, 1)), np.atleast_2d(x), np.atleast_2d(v), signs
            forms = pressing(self.kernel)(*at)[1]
        for j, (place, law) in enumerate(zip(self.kernel.places, self._laws, strict=True)):
            part = slopes[:, place]
            norm = np.linalg.norm(part, axis=1) if law == "length" else np.abs(part).max(axis=1)
            if law in ACROSS:  # of p t / |t| at this state: beside it the bound is another
                p, size = forms[:, place][:, 0], np.linalg.norm(forms[:, place][:, 1:], axis=1)
                norm = (
                    np.abs(part[:, 0])
                    + np.linalg.norm(part[:, 1:], axis=1)
                    * np.abs(p / np.maximum(size, LEAST))[:, None]
                )
            K[:, j] = norm
        return K, 1 + K.sum(axis=2)

    def contractions(self, t: Floats | float, x: Unknowns, v: Floats, signs: Floats) -> Any:
        """Return bounds (n,) of the contraction of sizes: below 1 there is one solution."""
        K, weights = self._growths(t, x, v, signs)
        return (np.einsum("nij,nj->ni", K, weights) / weights).max(axis=1, initial=0.0)

    def _share(self, t: float, x: Unknowns, v: Floats, signs: Floats) -> float:
        """Return the share of the coefficients with which one solution is sure, 0 for none."""
        K, weights = (part[0] for part in self._growths(t, x, v, signs))
        rubs = [feedback.friction for feedback in self.setup.released.rubbing.feedbacks]
        given = weights - (K * ~np.array(rubs)) @ weights
        share = float(np.min(given / np.maximum((K * np.array(rubs)) @ weights, 1e-300)))
        return max(share, 0.0)

    @property
    def _laws(self) -> list[str]:
        return [feedback.law for feedback in self.setup.released.rubbing.feedbacks]

    def _parts(
        self, t: float, x: Unknowns, v: Floats, signs: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return solutions by unit of friction, the linear forms and their slopes, see `Kernel`."""
        columns, starts, slopes = (
            part[0] for part in self._coupling(np.array([[t]]), x[None, :], v[None, :], signs)
        )
        rubs = self.kernel.rubs
        return columns.reshape(rubs + 1, -1).T, starts, slopes.reshape(rubs, -1).T

    def solutions(
        self, t: float, x: Unknowns, v: Floats, signs: Floats
    ) -> list[tuple[Floats, Floats]]:
        """Return all sizes of friction that fit their laws, and accelerations of x with each."""
        columns, starts, slopes = self._parts(t, x, v, signs)
        n, places = self.kernel.n, self.kernel.places
        parts = ([every[place] for place in places] for every in (starts, slopes))
        found, _ = solutions_of(self._laws, *parts)
        return [(m, columns[:n, 0] + columns[:n, 1:] @ m) for m in found]

    @property
    def joints(self) -> list[str]:
        """Joints whose friction follows from their reactions."""
        feedbacks = self.setup.released.rubbing.feedbacks
        return list(dict.fromkeys(feedback.joint for feedback in feedbacks if feedback.friction))

    def pulls(
        self, t: float, x: Unknowns, v: Floats, signs: Floats, m: Floats | None = None
    ) -> bool:
        """Return whether a contact that is declared one-sided would have to pull."""
        if not self._contacts:
            return False
        at = (np.array([[t]]), np.atleast_2d(x), np.atleast_2d(v))
        if m is None:
            a, inner = self._rates(*at, signs)
        else:
            columns = self._parts(t, x, v, signs)[0]
            whole = columns[:, 0] + columns[:, 1:] @ m
            n = self.kernel.n
            a, inner = whole[None, :n], np.concatenate([whole[n:], m])[None, :]
        holding = [each.holding(*at, signs, a, inner) for each in self._contacts]
        return any(bool((force < 0).any()) for force in holding)

    def _one_left(
        self, t: float, x: Unknowns, v: Floats, signs: Floats, found: list[tuple[Floats, Floats]],
        agrees: Callable[[Any], bool] | None,
    ) -> bool:  # fmt: skip
        """Return whether all solutions but one are ruled out.

        Contacts declared one-sided do not pull, what starts moves the way its friction says, and
        the solution of slips that have started is followed. A rule that none agrees with is none.
        """
        sizes = self._rates(np.array([[t]]), x[None, :], v[None, :], signs)[1][0]
        sizes = sizes[len(sizes) - self.kernel.rubs :]
        rubbing = self.setup.released.rubbing
        places = [j for j, k in enumerate(rubbing.owners) if k in self.started]

        def follows(m: Floats) -> bool:
            return apart(m[places], sizes[places]) <= SAME

        rules = {
            "contacts that are declared one-sided would have to pull": (
                lambda m: not self.pulls(t, x, v, signs, m)
            ),
            "what starts would move against its friction": agrees,
            "it is not the one that these pairs have started with": follows if places else None,
        }
        count, used = len(found), list[str]()
        for text, rule in rules.items():
            remaining = found if rule is None else [entry for entry in found if rule(entry[0])]
            if len(found) > 1 and 0 < len(remaining) < len(found):
                found, used = remaining, [*used, text]
        if len(found) > 1 or apart(found[0][0], sizes) > SAME:  # Newton's method is elsewhere
            return False
        note = (
            f"from t = {t:.9g} s on {count} solutions fit the dry friction of "
            f"{', '.join(self.joints)}, all but one are ruled out: {'; '.join(used)}"
        )
        self.notes.setdefault(tuple(used), note)
        return True

    def check(
        self,
        t: float,
        x: Unknowns,
        v: Floats,
        signs: Floats,
        agrees: Callable[[Any], bool] | None = None,
    ) -> bool:
        """Raise where the laws of friction give no accelerations, or several.

        `agrees`: sizes of friction -> whether slips that start move the way their friction says.

        Returns
        -------
        bool
            Whether of several solutions all but one are ruled out.
        """
        if not self.kernel.rubs:
            return False
        bound = float(self.contractions(t, x, v, signs)[0])
        if bound < 1:
            return False
        found = self.solutions(t, x, v, signs)
        if len(found) == 1:
            return False
        if found and self._one_left(t, x, v, signs, found, agrees):
            return True
        joints = self.joints
        names = [".".join(c.key) for c in self.kernel.released.coordinates]
        text = f"dry friction of {', '.join(joints)}"
        share = self._share(t, x, v, signs)
        sure = f"; one solution is sure with {share:.6g} of the coefficients" if share > 0 else ""
        if not found:
            note = f"jammed (F1): no accelerations fit the {text}{sure}"
            raise NoWay(note, code="F1", joints=joints, kappa=bound, share=share, solutions=[])
        listed = "; ".join(
            ", ".join(f"{name} {value:.9g}" for name, value in zip(names, a, strict=True))
            for _, a in found
        )
        raise NoWay(
            f"{len(found)} solutions (F2) fit the {text}, which does not decide between them: "
            f"accelerations {listed}{sure}",
            "ambiguous",
            "F2",
            joints=joints,
            kappa=bound,
            share=share,
            solutions=[dict(zip(names, a.tolist(), strict=True)) for _, a in found],
        )
