"""Where contacts that are declared one-sided would have to pull: events ``lift_off``.

A joint with the key ``one_sided`` keeps both of its bodies together whatever acts; a real contact
parts where the force by which they hold would have to change its sign. The motion goes on as if the
contact held; what happens after it parts is not modelled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.joint import Joint
from mechdae.describe.units import shown
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import Integrator, Nodes
from mechdae.dynamics.output_values import Observer, States
from mechdae.dynamics.watchers.zeros import DEGREE, Looker, fitted
from mechdae.equations.forces.friction import tangent_of
from mechdae.equations.joints import Ends
from mechdae.equations.model import Model
from mechdae.equations.space import left
from mechdae.forces.formula_changes import SAMPLES, State
from mechdae.forces.inverse_dynamics import InverseDynamics, LoadedPoses, absolute
from mechdae.forces.poses import Moving, PoseForces
from mechdae.forces.uniqueness import Uniqueness
from mechdae.kernels.run.functions import Batch
from mechdae.motion.continuation.legs import Legs
from mechdae.numerics.changes import arcs_of, changes, narrowed
from mechdae.records import dataclass
from mechdae.results import Event, motion_event
from mechdae.results.status import stretches
from mechdae.types import Booleans, Floats, Integers, Json, Matrices, Points, Sym, Unknowns

SX = ca.SX
POSITIVE = ("left", "positive", "push")


@dataclass(frozen=True)
class OneSided:
    """A one-sided contact.

    ``form`` (3,), in space (6,), is an expression of the coordinates; times the joint's reaction
    (force, and moment about the second point) it is the force [N], of a gear the moment [N m], by
    which the contact holds. Where ``half`` is given the moment over it is taken off: a block of
    that half length tips before it lifts.
    """

    name: str
    unit: str
    form: Sym
    half: Any = None


def one_sided(model: Model, among: Iterable[str]) -> list[OneSided]:
    """Return the contacts among some joints that are declared one-sided."""
    result = []
    for name in among:
        joint = model.mechanism.joints[name]
        side = getattr(joint, "one_sided", None)
        if side is None:
            continue
        sign = 1.0 if side in POSITIVE else -1.0
        unit = "N m" if joint.wheels == 2 else "N"
        if model.space.behind:
            result.append(OneSided(name, unit, sign * IN_SPACE[joint.kind](model, joint)))
            continue
        ends = model.ends[name]
        form = sign * FORMS[joint.kind](ends)
        tilts = getattr(joint, "contact_length", None) is not None
        half = ends.number("contact_length") / 2 if tilts else None
        result.append(OneSided(name, unit, form, half))
    return result


def _across(ends: Ends) -> Any:
    return ca.vertcat(ends.normal(), SX(0))


def _beside(ends: Ends) -> Sym:
    return ca.vertcat(left(tangent_of(ends)), SX(0))


def _turning(ends: Ends) -> Any:
    return SX([0, 0, 1])


def _along_rack(ends: Ends) -> Any:
    a = ends.number("axis")
    return ca.vertcat(ends.second.direction(ca.vertcat(ca.cos(a), ca.sin(a))), SX(0))


def _apart(ends: Ends) -> Sym:
    return ca.vertcat(ends.gap / ca.sqrt(ca.sumsqr(ends.gap)), SX(0))


FORMS = {
    "prismatic": _across,
    "pin-in-slot": _across,
    "curve": _beside,
    "gear": _turning,
    "rack": _along_rack,
    "distance": _apart,
}
"""By kind: what of the reaction on the second body is positive towards its left, its positive
sense, or away from the first body."""


def _gap_in_space(model: Any, joint: Joint) -> Sym:
    gap = model.point(joint.second) - model.point(joint.first)
    return ca.vertcat(gap / ca.norm_2(gap), SX(3, 1))


def _off_plane(model: Any, joint: Joint) -> Sym:
    return ca.vertcat(model.axes_of(joint.name)[0][:, 2], SX(3, 1))


def _on_carrier(model: Any, joint: Joint) -> Sym:
    """Return the axis of the second member on the carrier and, of a wheel, its moment about it."""
    bearing = bearings(model.mechanism, joint)[1]
    axis = bearing.sense * model.axes_of(bearing.joint)[0][:, 2]
    if joint.wheels == 1:
        return ca.vertcat(axis, SX(3, 1))
    arm = model.point(joint.second) - model.point(model.mechanism.joints[bearing.joint].second)
    return ca.vertcat(ca.cross(axis, arm), axis)


IN_SPACE = {
    "distance": _gap_in_space,
    "planar": _off_plane,
    "gear": _on_carrier,
    "rack": _on_carrier,
}
"""The same in space: away from the first body, along the normal of the plane, in the positive
sense on the carrier."""


NOTHING = 1e-12
"""Share of the largest reaction of the mechanism that is rounding."""
ForceAt = Callable[[Floats], Floats]
"""From places (n,) to the force by which a contact holds there, (n,), or those of all, (n, k)."""


@dataclass
class Pull:
    """An interval over which a contact would have to pull.

    ``start`` and ``end`` are places, ``force`` (below 0) is the strongest pull, ``worst`` its
    place.
    """

    joint: str
    start: float
    end: float
    force: float
    worst: float

    @property
    def facts(self) -> dict[str, Any]:
        """What its event ``lift_off`` tells beside its place."""
        return {
            "joint": self.joint, "until": self.end, "force": self.force, "strongest_at": self.worst,
        }  # fmt: skip


class OneSidedContacts:
    """The one-sided contacts among joints of a model, as functions of coordinates and reactions."""

    def __init__(self, model: Model, among: Iterable[str]) -> None:
        self.model = model
        self.found: list[OneSided] = one_sided(model, among)
        self.unit: dict[str, str] = {contact.name: contact.unit for contact in self.found}
        self.scale: float = model.mechanism.scale

    @property
    def names(self) -> list[str]:
        return [contact.name for contact in self.found]

    @cached_property
    def _forms(self) -> Batch:
        model = self.model
        rows = [ca.vertcat(contact.form, contact.half or ca.SX.inf()) for contact in self.found]
        function = ca.Function("forms", [model.q, model.p], [ca.densify(ca.vertcat(*rows))])
        return Batch(function, [1], straight=lambda: None)

    def holding(self, q: Unknowns, reactions: dict[str, Floats]) -> Floats:
        """Return the forces (n, k) by which the contacts hold, negative where they would pull.

        `q` (n, nq) are absolute coordinates, `reactions` (n, 3), in space (n, 6), by joint on the
        second body.
        """
        space = self.model.space
        forms = self._forms(q, self.model.p_values)[0].reshape(len(q), -1, space.freedoms + 1)
        acting = np.stack([reactions[name] for name in self.names], axis=1)
        push = np.sum(forms[:, :, :-1] * acting, axis=2)
        push -= np.abs(acting[:, :, -1]) / forms[:, :, -1]
        every = np.stack(
            [reaction[:, : len(space.axes)] for reaction in reactions.values()], axis=1
        )
        largest = np.nanmax(np.abs(every), axis=(1, 2), initial=0.0)[:, None]
        turning = np.array([contact.unit != "N" for contact in self.found])
        rounding = NOTHING * np.where(turning, largest * self.scale, largest)
        return np.where(np.abs(push) <= rounding, 0.0, push)


def arcs(s: Floats, forces: Floats, names: list[str], look: ForceAt | None = None) -> list[Pull]:
    """Return the intervals over which contacts would pull.

    Parameters
    ----------
    s, forces
        Rising places (n,), and the forces (n, k) by which the contacts hold there; nan where there
        are none.
    names
        Of the contacts, (k,).
    look
        From places to forces: places between those given count too. Zeros are bracketed between
        neighbours, of which one may be where the force is least.
    """
    found: list[Pull] = []
    for k, name in enumerate(names):
        force_at = None if look is None else _of(look, k)
        places, f = _with_dips(s, forces[:, k], force_at)
        found += [
            Pull(name, low, high, *_least(force_at, places, f, low, high))
            for low, high in _pulls(places, f, force_at)
        ]
    return found


def _of(look: ForceAt, k: int) -> ForceAt:
    return lambda places: look(places)[:, k]


def _each(force_at: ForceAt) -> ForceAt:
    """Return the force at places in rows, (n, m)."""
    return lambda places: force_at(places.ravel()).reshape(places.shape)


def _pulls(s: Floats, f: Floats, force_at: ForceAt | None) -> list[list[float]]:
    """Return where pulls begin and end."""

    def marked(f: Floats) -> tuple[Integers, Floats]:
        with np.errstate(invalid="ignore"):
            return (f < 0).astype(int)[:, None], f[:, None]

    marks, values = marked(f)
    if force_at is None:
        return [[float(s[first]), float(s[end - 1])] for first, end in stretches(marks[:, 0])]
    found = changes(s, marks, values, [("sign", slice(0, 1))], lambda at: marked(force_at(at)))
    return arcs_of(0, marks, found, s)


def _with_dips(s: Floats, f: Floats, force_at: ForceAt | None) -> tuple[Floats, Floats]:
    """Return places and forces with the least ones between neighbours that might be below zero."""
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero((f[1:-1] > 0) & (f[1:-1] <= f[:-2]) & (f[1:-1] <= f[2:])) + 1
        near = f[rows] <= np.maximum(f[rows - 1], f[rows + 1]) - f[rows]
    rows = rows[near]
    if force_at is None or not rows.size:
        return s, f
    places = narrowed(_each(force_at), s[rows - 1], s[rows + 1])
    order = np.argsort(np.concatenate([s, places]), kind="stable")
    return np.concatenate([s, places])[order], np.concatenate([f, force_at(places)])[order]


def _least(
    force_at: ForceAt | None, s: Floats, f: Floats, low: float, high: float
) -> tuple[float, float]:
    """Return the strongest pull from `low` to `high`, and where it is."""
    k = int(np.argmin(np.where((s >= low) & (s <= high) & (f < 0), f, np.inf)))
    best = (float(f[k]), float(s[k])) if low <= s[k] <= high else (0.0, low)
    if force_at is not None:
        a, b = max(low, float(s[max(k - 1, 0)])), min(high, float(s[min(k + 1, len(s) - 1)]))
        ends = (a, b) if a < b else (low, high)
        place = float(narrowed(_each(force_at), *(np.array([end]) for end in ends))[0])
        best = min(best, (float(force_at(np.array([place]))[0]), place))
    return best


def sentence(pull: Pull, unit: str, spoken: Callable[[float], str]) -> str:
    """Return what is said of a pull; `spoken` writes a place with its unit."""
    return (
        f"joint {pull.joint}: the one-sided contact would have to pull from {spoken(pull.start)} "
        f"to {spoken(pull.end)}, by up to {-pull.force:.6g} {unit} at {spoken(pull.worst)}: it "
        f"lifts off there, and what follows is not modelled"
    )


def at_rest(model: Model, q: Unknowns, reactions: dict[str, Floats]) -> list[str]:
    """Return what is said of contacts in an equilibrium; arrays have one row."""
    contacts = OneSidedContacts(model, model.mechanism.joints)
    lost = [n for n in contacts.names if n not in reactions or np.isnan(reactions[n]).any()]
    if lost or not contacts.found:
        return [unwatched(lost)] if lost else []
    return [
        f"joint {contact.name}: the one-sided contact would have to pull by {-force:.6g} "
        f"{contact.unit}: it lifts off, this equilibrium is that of a contact that holds"
        for contact, force in zip(contacts.found, contacts.holding(q, reactions)[0], strict=True)
        if force < 0
    ]


def unwatched(names: list[str]) -> str:
    """Return what is said of contacts whose reactions are open."""
    return f"{', '.join(names)}: not watched for lifting off, the reaction is not unique"


def along(
    statics: InverseDynamics, moving: Moving, answer: PoseForces, unique: Uniqueness | None
) -> tuple[list[Json], list[str]]:
    """Return the events and what is said of one-sided contacts of a task of reactions.

    Places are the driver's values, or times. Between poses forces are solved for again where the
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
        return [], [unwatched(lost)]
    count = statics.scene.model.q.numel()

    def holding(motion: LoadedPoses, reactions: Matrices, there: Booleans) -> Floats:
        q = np.zeros((len(motion), count))
        q[:, balance.columns] = absolute(statics.scene, motion)[0]
        by_joint = {name: reactions[:, k] for k, name in enumerate(balance.joints)}
        return np.where(there[:, None], contacts.holding(q, by_joint), np.nan)

    state = State(statics, moving)

    def force(s: Floats) -> Floats:
        here = state.at(s)
        return holding(here.motion, here.whole.reactions, here.standing)

    plan = moving.setting.plan
    lead = plan.coordinates[plan.lead]
    places = np.unique(np.asarray(moving.run.places, float))
    single = not isinstance(moving.run.path, Legs)
    if single and len(places) > 1:
        grid = np.union1d(places, np.linspace(places[0], places[-1], SAMPLES + 1))
        found = arcs(grid, force(grid), contacts.names, force)
    else:
        values = holding(answer.motion, answer.whole.reactions, answer.standing)
        found = arcs(answer.motion.u[:, plan.lead], values, contacts.names)
    timed = single and not moving.by_value

    def spoken(place: float) -> str:
        return f"t = {place:.6g} s" if timed else f"{lead.text} = {shown(lead.unit, place)}"

    events = []
    for pull in found:
        when = {"time": pull.start} if timed else {}
        at = {"kind": "lift_off", "at": pull.start, "in_range": True, **when}
        events.append(at | pull.facts)
    return events, [sentence(pull, contacts.unit[pull.joint], spoken) for pull in found]


PLACES = (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2
"""Samples in a part of a step, as `fitted` takes them."""


class HoldingContacts:
    """The forces by which contacts that are declared one-sided hold, at states of a motion."""

    def __init__(self, setup: MotionProblem) -> None:
        self.setup = setup
        self.contacts: OneSidedContacts = OneSidedContacts(
            setup.model, setup.model.mechanism.joints
        )
        self.names: list[str] = self.contacts.names
        self.observer: Observer | None = Observer(setup) if self.names else None

    def holding(
        self, t: Floats, x: Unknowns, v: Floats, signs: Floats, a: Floats, lam: Points
    ) -> Floats:
        """Return the forces (n, k) by which contacts hold, at states with the same signs.

        `a` and `lam` are accelerations and what goes with them, (n, .) each.
        """
        observer, setup = self.observer, self.setup
        assert observer is not None
        rows = setup.sided(t, x, v, np.broadcast_to(signs, (len(x), len(signs))))
        states = observer.complete(States(t[:, 0], x, v, a, lam, np.zeros((len(x), 0)), rows))
        q = observer.absolute(states)[0]
        return self.contacts.holding(q, observer.reactions(states, observer.multipliers(states)))


class Lifting:
    """The arcs of time over which contacts would have to pull."""

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.integrator, self.contacts = integrator, HoldingContacts(setup)
        self.found: list[Pull] = []
        self.open: list[str] = []

    def look(self, nodes: Nodes) -> None:
        """Look at the forces inside accepted steps."""
        if not self.contacts.names or len(nodes.states) < 2:
            return
        lay, signs = self.integrator.layout, nodes.signs

        def values(t: Floats, x: Unknowns, v: Floats) -> Floats:
            return self.contacts.holding(t, x, v, signs, *self.integrator.rates(t, x, v, signs))

        looker, k = Looker(self.integrator, nodes, values), len(self.contacts.names)
        begins = lay.of(nodes.states, "t")
        rows, lows, highs, samples = fitted(lay, nodes, values)
        shares = lows[:, None] + (highs - lows)[:, None] * PLACES
        times, firsts = np.unique(
            (begins[rows] + np.diff(begins)[rows] * shares.T).T, return_index=True
        )

        def force(t: Floats) -> Floats:
            row = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, len(begins) - 2)
            share = (t - begins[row]) / (begins[row + 1] - begins[row])
            pairs = zip(row.tolist(), share.tolist(), strict=True)
            states = np.array([looker.at(*pair) for pair in pairs])
            return values(lay.of(states, "t")[:, None], lay.of(states, "x"), lay.of(states, "v"))

        for pull in arcs(times, samples.reshape(-1, k)[firsts], self.contacts.names, force):
            last = next((p for p in reversed(self.found) if p.joint == pull.joint), None)
            if last is not None and last.end >= times[0] >= pull.start:  # it goes on
                stronger = min(last, pull, key=lambda one: one.force)
                last.force, last.worst, last.end = stronger.force, stronger.worst, pull.end
            else:
                self.found.append(pull)

    def leave_out(self, names: Iterable[str]) -> None:
        """Forget contacts whose reactions are not unique, or not known."""
        self.open = [name for name in self.contacts.names if name in set(names)]
        self.found = [pull for pull in self.found if pull.joint not in self.open]

    def events(self) -> list[Event]:
        """Return the events ``lift_off``."""
        return [motion_event("lift_off", pull.start, **pull.facts) for pull in self.found]

    def notes(self) -> list[str]:
        """Return the same in sentences."""
        lost = [unwatched(self.open)] if self.open else []
        return lost + [
            sentence(pull, self.contacts.contacts.unit[pull.joint], lambda t: f"t = {t:.6g} s")
            for pull in self.found
        ]
