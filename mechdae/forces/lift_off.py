"""Where contacts that are declared one-sided would have to pull: events ``lift_off``.

The motion goes on as if the contact held; what happens after it parts is not modelled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.assembly.start import shown
from mechdae.continuation.legs import Legs
from mechdae.forces.inverse_dynamics import Statics, absolute
from mechdae.forces.kinks import SAMPLES, State
from mechdae.forces.pose_forces import PoseForces
from mechdae.forces.poses import Moving
from mechdae.forces.uniqueness import Uniqueness
from mechdae.kernels.run.batch import Batch
from mechdae.model.forces.one_sided import one_sided
from mechdae.model.model import Model
from mechdae.numerics.roots import halved

SHARES = 80
"""Steps of the search for the strongest pull in an arc, each to two thirds."""
NOTHING = 1e-12
"""Share of the largest reaction of the mechanism that is rounding."""
Arc = dict[str, Any]


class OneSidedContacts:
    """The one-sided contacts among joints of a model, as functions of coordinates and reactions."""

    def __init__(self, model: Model, among: Iterable[str]) -> None:
        self.model = model
        self.found = one_sided(model, among)
        self.unit = {own.name: own.unit for own in self.found}
        self.scale = model.mechanism.scale

    @property
    def names(self) -> list[str]:
        return [own.name for own in self.found]

    @cached_property
    def _forms(self) -> Batch:
        model = self.model
        rows = [ca.vertcat(own.form, own.half or ca.SX.inf()) for own in self.found]
        function = ca.Function("forms", [model.q, model.p], [ca.densify(ca.vertcat(*rows))])
        return Batch(function, [1], straight=lambda: None)

    def holding(self, q: Any, reactions: dict[str, Any]) -> Any:
        """Return the forces (n, k) by which the contacts hold, negative where they would pull.

        `q` (n, nq) are absolute coordinates, `reactions` (n, 3) by joint on the second body.
        """
        forms = self._forms(q, self.model.p_values)[0].reshape(len(q), -1, 4)
        acting = np.stack([reactions[name] for name in self.names], axis=1)
        push = np.sum(forms[:, :, :3] * acting, axis=2)
        push -= np.abs(acting[:, :, 2]) / forms[:, :, 3]
        every = np.stack([own[:, :2] for own in reactions.values()], axis=1)
        largest = np.nanmax(np.abs(every), axis=(1, 2), initial=0.0)[:, None]
        turning = np.array([own.unit != "N" for own in self.found])
        rounding = NOTHING * np.where(turning, largest * self.scale, largest)
        return np.where(np.abs(push) <= rounding, 0.0, push)


def arcs(force: Callable[[Any], Any], grid: Any, names: list[str]) -> list[Arc]:
    """Return the intervals over which contacts would pull.

    Parameters
    ----------
    force
        From places (n,) to the forces (n, k) by which the contacts hold; nan where there are none.
    grid
        Rising places; zeros are bracketed between neighbours, of which one may be where the force
        is least.
    names
        Of the contacts, (k,).

    Returns
    -------
    list of dict
        ``joint``, ``from`` and ``to``, ``force`` (the strongest pull, below 0) and ``worst``, its
        place.
    """
    found: list[Arc] = []
    values = force(grid)
    for k, name in enumerate(names):

        def own(s: Any, k: int = k) -> Any:
            return force(s)[:, k]

        s, f = _with_dips(grid, values[:, k], own)
        with np.errstate(invalid="ignore"):
            pulls = f < 0
        edges = np.flatnonzero(np.diff(np.concatenate([[0], pulls.astype(int), [0]])))
        for first, end in edges.reshape(-1, 2):
            low = _edge(own, s, f, first - 1, first) if first else s[0]
            high = _edge(own, s, f, end, end - 1) if end < len(s) else s[-1]
            worst = _least(own, s, f, first, end)
            found.append({"joint": name, "from": float(low), "to": float(high), **worst})
    return found


def _with_dips(s: Any, f: Any, own: Callable[[Any], Any]) -> tuple[Any, Any]:
    """Return places and forces with the least ones between neighbours that might be below zero."""
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero((f[1:-1] > 0) & (f[1:-1] <= f[:-2]) & (f[1:-1] <= f[2:])) + 1
        near = f[rows] <= np.maximum(f[rows - 1], f[rows + 1]) - f[rows]
    rows = rows[near]
    if not rows.size:
        return s, f
    places = _narrowed(own, s[rows - 1], s[rows + 1])
    order = np.argsort(np.concatenate([s, places]), kind="stable")
    return np.concatenate([s, places])[order], np.concatenate([f, own(places)])[order]


def _narrowed(own: Callable[[Any], Any], a: Any, b: Any) -> Any:
    """Return where the force is least in intervals [a, b] with one minimum each."""
    for _ in range(SHARES):
        left, right = a + (b - a) / 3, b - (b - a) / 3
        values = own(np.concatenate([left, right]))
        first, last = values[: len(a)], values[len(a) :]
        with np.errstate(invalid="ignore"):
            lower = first < last
        a, b = np.where(lower, a, left), np.where(lower, right, b)
    return (a + b) / 2


def _edge(own: Callable[[Any], Any], s: Any, f: Any, outer: int, inner: int) -> float:
    """Return where the force is zero between two places; the inner one beside no force."""
    a, b = float(s[outer]), float(s[inner])
    if not np.isfinite(f[outer]):
        return b
    return halved(lambda place: float(own(np.array([place]))[0]) >= 0, a, b)[1]


def _least(own: Callable[[Any], Any], s: Any, f: Any, first: int, end: int) -> Arc:
    """Return the strongest pull among places `first` to `end`, and where it is."""
    k = first + int(np.argmin(f[first:end]))
    a, b = s[max(k - 1, 0)], s[min(k + 1, len(s) - 1)]
    place, force = float(s[k]), float(f[k])
    if b > a:
        between = _narrowed(own, np.array([a]), np.array([b]))
        value = float(own(between)[0])
        if value < force:
            place, force = float(between[0]), value
    return {"force": force, "worst": place}


def sentence(arc: Arc, unit: str, spoken: Callable[[float], str]) -> str:
    """Return what is said of an arc; `spoken` writes a place with its unit."""
    return (
        f"joint {arc['joint']}: the one-sided contact would have to pull from "
        f"{spoken(arc['from'])} to {spoken(arc['to'])}, by up to {-arc['force']:.6g} {unit} at "
        f"{spoken(arc['worst'])}: it lifts off there, and what follows is not modelled"
    )


def along(
    statics: Statics, moving: Moving, answer: PoseForces, unique: Uniqueness | None
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the events and what is said of one-sided contacts of a task of reactions.

    Places are the driver's values, or times. Between poses forces are solved for anew where the
    task follows one path; along lines in the values of several drivers at the poses alone.
    """
    balance = statics.balance
    contacts = OneSidedContacts(statics.scene.model, balance.joints)
    if not contacts.found:
        return [], []
    lost = [
        n for n in contacts.names if unique is not None and not unique.given(balance, n, "reaction")
    ]
    if lost:
        text = f"{', '.join(lost)}: not watched for lifting off, the reaction is not unique"
        return [], [text]
    count = statics.scene.model.q.numel()

    def holding(motion: Any, reactions: Any, there: Any) -> Any:
        q = np.zeros((len(motion), count))
        q[:, balance.columns] = absolute(statics.scene, motion)[0]
        own = {name: reactions[:, k] for k, name in enumerate(balance.joints)}
        return np.where(there[:, None], contacts.holding(q, own), np.nan)

    state = State(statics, moving)

    def force(s: Any) -> Any:
        here = state.at(s)
        return holding(here.motion, here.whole.reactions, here.standing)

    plan = moving.setting.plan
    lead = plan.coordinates[plan.lead]
    places = np.unique(np.asarray(moving.run.places, float))
    single = not isinstance(moving.run.path, Legs)
    if single and len(places) > 1:
        grid = np.union1d(places, np.linspace(places[0], places[-1], SAMPLES + 1))
        found = arcs(force, grid, contacts.names)
    else:
        values = holding(answer.motion, answer.whole.reactions, answer.standing)
        found = at_poses(values, contacts.names, answer.motion.u[:, plan.lead])
    timed = single and not moving.by_value

    def spoken(place: float) -> str:
        return f"t = {place:.6g} s" if timed else f"{lead.text} = {shown(lead.unit, place)}"

    events = []
    for arc in found:
        event = {"kind": "lift_off", "joint": arc["joint"], "at": arc["from"], "until": arc["to"]}
        event |= {"force": arc["force"], "strongest_at": arc["worst"], "in_range": True}
        events.append(event | ({"time": arc["from"]} if timed else {}))
    return events, [sentence(arc, contacts.unit[arc["joint"]], spoken) for arc in found]


def at_poses(values: Any, names: list[str], places: Any) -> list[Arc]:
    """Return the runs of poses at which contacts would pull."""
    found: list[Arc] = []
    for k, name in enumerate(names):
        with np.errstate(invalid="ignore"):
            pulls = values[:, k] < 0
        edges = np.flatnonzero(np.diff(np.concatenate([[0], pulls.astype(int), [0]])))
        for first, end in edges.reshape(-1, 2):
            worst = first + int(np.argmin(values[first:end, k]))
            arc = {"joint": name, "from": float(places[first]), "to": float(places[end - 1])}
            found.append(arc | {"force": float(values[worst, k]), "worst": float(places[worst])})
    return found
