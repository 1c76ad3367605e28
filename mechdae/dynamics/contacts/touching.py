"""Contacts of joints along a motion: free flight, impact, contact that lasts.

A gap that closes is an impact. Behind it the contact rebounds, or it stays closed as a constraint
for as long as its force pushes. Rebounds lower than `LOW` are left out: the contact closes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from mechdae.describe.joints.joint import LIMITS
from mechdae.describe.joints.limits import with_gaps
from mechdae.dynamics.contacts.gaps import BUSH, STOPS
from mechdae.dynamics.contacts.hit import Hit
from mechdae.dynamics.equations import DRIVERS, IMPACTS, MotionProblem
from mechdae.dynamics.integrate import ContactEvent, Cut, Integrator, Nodes, NoWay
from mechdae.dynamics.output_values import States
from mechdae.dynamics.watchers.zeros import Looker, Sign, Values, changes
from mechdae.equations.forces.feedback import Unilateral
from mechdae.errors import InputError, MechanismError
from mechdae.results import Event, LazyPart, motion_event
from mechdae.types import Booleans, Floats, Integers, Unknowns

if TYPE_CHECKING:
    from mechdae.dynamics.unique import Determined
    from mechdae.dynamics.watchers.sticking import Sticking

TOUCHES = 1e-11
"""Gap, in natural sizes, up to which contacts close in the same instant."""
BEYOND = 1e-9
"""Depth, in natural sizes, from which a start is beyond a stop."""
LOW = 1e-12
"""Height of a rebound, in natural sizes, below which a contact stays closed."""
STILL = 1e-12
"""Speed, over the natural ones, that is none."""
CLOSE = 1e-9
"""Share of the force of a contact, over the largest so far, up to which it is none."""
DOUBT, SURE = 1e-12, 100.0
"""Share of the largest force, or of a natural acceleration, that is rounding, and how many of these
are not."""
SOON = (1e-9, 1e-7, 1e-5)
"""Shares of the whole time after which forces tell what is about to come."""
CROWD, NEAR = 200, 1e-12
"""Events of contacts in one instant, a share of the whole time, that end a motion."""
OVER = 1.25
"""First step behind an impact over the time of the rebound."""
NONE = 1e-13
"""Share of the force that gives a natural acceleration up to which one is none."""
FLAT = 1e-6
"""Mobility of a contact, over the largest, that counts at least for natural forces."""
TINY = 1e-300
TURN = 2 * np.pi


class Touching:
    """Watches the gaps of open contacts and the forces of closed ones, and goes on behind events.

    ``found`` are the events, ``rebounds`` the impacts by contact, ``notes`` what is to be said.
    """

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.setup, self.integrator, self.kernel = setup, integrator, setup.kernel
        self.contacts: list[Unilateral] = setup.unilateral
        self.count: int = setup.released.rubbing.count
        values = setup.model.mechanism.values()
        self.e: Floats = np.array([values[f"{c.owner}.restitution"] for c in self.contacts])
        self.friction: list[float] = [values.get(f"{c.owner}.friction", 0.0) for c in self.contacts]
        sizes = [1.0 if c.unit == "rad" else setup.length for c in self.contacts]
        self.sizes: Floats = np.array(sizes)
        self.turns = self.shift = np.zeros(len(self.contacts))
        self._inertia = np.zeros(len(self.contacts))
        self.law: str = setup.task.impact or "newton"
        self.found: list[Event] = []
        self.rebounds: Integers = np.zeros(len(self.contacts), int)
        self._notes: dict[tuple[str, str], str] = {}
        self._strongest = self._fast = 0.0
        self._times: deque[float] = deque(maxlen=CROWD)

    # -- values --------------------------------------------------------------------------------

    @cached_property
    def _gaps(self) -> Callable[..., list[Floats]]:
        k, r = self.kernel, self.setup.released
        return k.batch("gaps", lambda: k.function("gaps", [ca.densify(r.gaps_of_contacts)]))

    @cached_property
    def _forces(self) -> Callable[..., list[Floats]]:
        return self.kernel.batch("sticking", lambda: self.kernel.sticking)

    def gaps(self, t: Floats | float, x: Unknowns, v: Floats, signs: Floats) -> Floats:
        """Return gaps (n, contacts) at states."""
        at = (np.reshape(t, (-1, 1)), np.atleast_2d(x), np.atleast_2d(v), signs)
        found: Floats = self._gaps(*at)[0] - self.shift
        return found

    def forces(
        self, t: Floats | float, x: Unknowns, v: Floats, signs: Floats
    ) -> tuple[Floats, Floats]:
        """Return accelerations of the gaps and forces of closed contacts, (n, contacts) each."""
        at = (np.reshape(t, (-1, 1)), np.atleast_2d(x), np.atleast_2d(v), signs)
        _, rates, held, *_ = self._forces(*at)
        return rates[:, self.count :], held[:, self.count :]

    def _watched(self, signs: Floats) -> Values:
        """Return the function (t, x, v) -> gaps of open contacts, forces of closed ones."""
        closed = self.setup.closed > 0

        def values(t: Floats, x: Unknowns, v: Floats) -> Floats:
            found = self.gaps(t, x, v, signs)
            if closed.any():
                held = self.forces(t, x, v, signs)[1][:, closed]
                self._strongest = max(self._strongest, float(np.abs(held).max(initial=0.0)))
                found[:, closed] = held + self._none[closed]  # without force it stays closed
            return found

        return values

    def look(self, nodes: Nodes) -> Cut | None:
        """Return the first event in accepted steps."""
        if len(nodes.states) < 2:
            return None
        lay = self.integrator.layout
        values, first = self._watched(nodes.signs), None
        self._fast = max(self._fast, float(lay.of(nodes.states, "omega").max()))
        start, closed = nodes.states[0], self.setup.closed > 0
        t, x, v = (lay.of(nodes.states, part) for part in "txv")
        at_nodes = values(t[:, None], x, v)
        deep = at_nodes < -TOUCHES * self.sizes
        pulls = at_nodes[0] < -CLOSE * self._strongest
        over = np.where(closed, pulls, deep[0] & self._falls(start))
        for which in np.flatnonzero(over).tolist():
            return Cut(start, touch=ContactEvent(start, which, bool(closed[which])))
        looker = Looker(self.integrator, nodes, values)
        for sign in changes(lay, nodes, values, falls=True):
            if first is not None and sign.row > first[0]:
                break
            for state, before in looker.states(sign):
                falls = before > 0 and (closed[sign.which] or self._falls(state)[sign.which])
                if falls and (first is None or lay.of(state, "t") < lay.of(first[1], "t")):
                    first = (sign.row, state, sign.which)
        missed = np.argwhere(deep[1:] & ~closed)
        if len(missed) and (first is None or missed[0][0] < first[0]):  # a fit did not see it
            row, which = missed[0].tolist()
            state = nodes.states[row]
            if at_nodes[row, which] > 0:
                state = looker.located(Sign(row, 0.0, 1.0, which, 1.0, False), 0.0, 1.0)
            first = (row, state, which)
        if first is None:
            return None
        _, state, which = first
        return Cut(state, touch=ContactEvent(state, which, bool(self.setup.closed[which])))

    @property
    def _none(self) -> Floats:
        """Forces of contacts that are none, beside what would give natural accelerations."""
        least: Floats = NONE * self._fast**2 * self._inertia
        return least

    def _falls(self, state: Floats) -> Booleans:
        """Return which gaps close with a speed (contacts,) at a state."""
        t, x, v = (state[self.integrator.layout[part]] for part in "txv")
        return np.asarray(self._speeds(t[0], x, v) < -STILL * self._fast * self.sizes)

    def _speeds(self, t: float, x: Unknowns, v: Floats) -> Floats:
        """Return the speeds of gaps (contacts,) at a state."""
        speeds = self.kernel.value("locking", t, x, v, self.setup.loose)[2].ravel()
        return speeds[self.count :]

    # -- the start -----------------------------------------------------------------------------

    def begin(
        self, sticking: Sticking, x: Unknowns, v: Floats, signs: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return works, rates of x and inputs of friction at the start."""
        lay = self.integrator.layout
        self._check_redundant(x, v)
        a = self.integrator.acceleration(0.0, x, v, signs)
        self._fast = max(self.integrator.frequency(v, a), 1 / self.setup.end)
        self.turns = self.shift = self._whole_turns(self.gaps(0.0, x, v, signs)[0])
        gaps = self.gaps(0.0, x, v, signs)[0]
        for contact, gap, size in zip(self.contacts, gaps, self.sizes, strict=True):
            if gap < -BEYOND * size:
                raise InputError(
                    f"joint {contact.owner} is beyond its stop ({contact.end}) by {-gap:.6g} "
                    f"{contact.unit}",
                    where="start",
                    hint=f"start within it, or change joints.{contact.owner}",
                )
        self._say_what_is_left_out()
        return self._behind(sticking, (0.0, x, v, np.zeros(lay.works)), signs, None)

    def _say_what_is_left_out(self) -> None:
        """Note what joints with gaps do without: friction, gaps of others."""
        model, values = self.setup.model, self.setup.model.mechanism.values()
        rubbing = {f.contact for f in self.setup.released.rubbing.feedbacks if f.friction}
        rub = {c.owner for i, c in enumerate(self.contacts) if i in rubbing}
        words = ("friction", "mesh_loss")
        dry = {n for n in model.mechanism.joints if any(values.get(f"{n}.{w}", 0.0) for w in words)}
        given = with_gaps(model.mechanism.joints, values) if self.setup.task.clearance else []
        ideal = [name for name in given if name not in model.in_gaps]
        said = {
            "moves in its gap without friction: contacts there do not rub": (dry & model.in_gaps)
            - rub,
            "has a gap and no restitution: it stays without a gap": ideal,
            "takes nothing from an impact: only a contact that rubs does": dry - model.in_gaps,
        }
        for text, names in said.items():
            for name in sorted(names):
                self._notes[name, text] = f"joint {name} {text}"

    def _check_redundant(self, x: Unknowns, v: Floats) -> None:
        """Raise where impulses are not unique: equations depend on each other."""
        setup, k = self.setup, self.kernel
        basis = setup.freedoms(k.value("place", 0.0, x, v, setup.loose)[1])
        superfluous = basis.shape[1] - (k.n - k.m) + len(setup.released.empty)
        if superfluous > 0:
            raise MechanismError(
                f"{superfluous} equations of the mechanism are redundant: impulses in its joints "
                "are not unique, and contacts are not computed",
                where=f"joints.{self.contacts[0].owner}.restitution",
                hint="mechdae show names them; a pin in a slot in place of a guide often helps",
            )

    def _whole_turns(self, gaps: Floats) -> Floats:
        """Return by how much gaps are shifted so that an angle is between its stops."""
        shift = np.zeros(len(gaps))
        for k, contact in enumerate(self.contacts[:-1]):
            pair = (
                contact.end == "low"
                and contact.owner == self.contacts[k + 1].owner
                and contact.unit == "rad"
            )
            if not pair:
                continue
            half, off = (gaps[k] + gaps[k + 1]) / 2, (gaps[k] - gaps[k + 1]) / 2
            if half < np.pi:
                shift[k] = TURN * np.round(off / TURN)
                shift[k + 1] = -shift[k]
        return shift

    # -- behind events -------------------------------------------------------------------------

    def beyond(
        self, sticking: Sticking, event: ContactEvent, signs: Floats
    ) -> tuple[Floats, Floats, tuple[str, Event] | None]:
        """Return the state and the inputs of friction right behind an event, and why it ends."""
        lay, state = self.integrator.layout, event.state
        x, v, w = (state[lay[part]] for part in "xvw")
        t = float(lay.of(state, "t"))
        released = event.contact if event.released else None
        w, v, signs = self._behind(sticking, (t, x, v, w), signs, released)
        step = min(float(lay.of(state, "h")), self._flight(t, x, v, signs))
        after = self.integrator.first(t, x, v, w, signs, step)
        after[lay["omega"]] = max(float(lay.of(after, "omega")), self._fast)
        after[lay["trials"]] = state[lay["trials"]]
        self._times.append(t)
        if len(self._times) < CROWD or t - self._times[0] > NEAR * self.setup.end:
            return after, signs, None
        name = self.contacts[event.contact].owner
        text = f"{CROWD} events of contacts, the last of {name}, at t = {t:.9g} s: no way to go on"
        return after, signs, (text, motion_event("chatter", t, code="F4", count=CROWD))

    def _flight(self, t: float, x: Unknowns, v: Floats, signs: Floats) -> float:
        """Return a step in which the shortest rebound that begins here is over."""
        speeds, rates = self._speeds(t, x, v), self.forces(t, x, v, signs)[0][0]
        near = self.gaps(t, x, v, signs)[0] <= TOUCHES * self.sizes
        moving = speeds > STILL * self._fast * self.sizes
        near &= (self.setup.closed == 0) & moving & (rates < 0)
        return float(np.min(OVER * 2 * speeds[near] / -rates[near], initial=np.inf))

    def _behind(
        self,
        sticking: Sticking,
        at: tuple[float, Unknowns, Floats, Floats],
        signs: Floats,
        released: int | None,
    ) -> tuple[Floats, Floats, Floats]:
        """Return works, rates of x and inputs of friction right behind an event."""
        t, x, v, w = at
        closed = self.setup.closed.copy()
        gaps = self.gaps(t, x, v, signs)[0]
        touching = np.flatnonzero((gaps <= TOUCHES * self.sizes) | (closed > 0))
        hit = Hit(self, t, x, v, touching)
        met = hit.fixed & (hit.before[: hit.n] < -STILL * self._fast * self.sizes[touching])
        for i in touching[met].tolist():
            raise self._blocked(self.contacts[i])
        mobility = np.diag(hit.normal) / self.sizes[touching] ** 2
        if (top := mobility.max(initial=0.0)) > 0:
            self._inertia[touching] = 1 / self.sizes[touching] / np.maximum(mobility, FLAT * top)
        v = hit.struck(self.e[touching])
        low = dict[int, float]()
        for _ in range(len(touching) + 1):
            speeds = dict(zip(touching.tolist(), hit.after[: hit.n], strict=True))
            resting = {i for i in touching.tolist() if speeds[i] <= self._still(i)}
            self._close(t, x, v, sorted(resting), released)
            rates = self.forces(t, x, v, self.setup.renewed(signs))[0][0]
            flying = [i for i in touching.tolist() if i not in resting]
            more = {
                i: rates[i] for i in flying
                if rates[i] < 0 and speeds[i] ** 2 <= -2 * rates[i] * LOW * self.sizes[i]
            }  # fmt: skip
            if not more:
                break
            for i, rate in more.items():
                e = self.e[i]
                low[i] = float(2 * speeds[i] / (-rate * (1 - e))) if e < 1 else np.inf
            v = hit.struck(np.array([0.0 if i in low else self.e[i] for i in touching.tolist()]))
        self._note(t, hit, closed, low)
        w = self._taken(w, hit)
        signs = self.setup.renewed(signs)
        if sticking.k:
            signs, v = sticking.first(t, x, v)
        self.shift = self.turns + np.minimum(gaps + self.shift - self.turns, 0.0)
        return w, v, signs

    def _blocked(self, contact: Unilateral) -> NoWay:
        """Return the verdict on a contact that closes with a speed that no impulse changes."""
        name, mechanism = contact.owner, self.setup.model.mechanism
        stop, ends = f"contact ({contact.end})", [end for end, _ in STOPS]
        if contact.end in ends:
            limit = mechanism.values()[f"{name}.{LIMITS[ends.index(contact.end)]}"]
            stop = f"stop ({contact.end}) of {limit:.6g} {contact.unit}"
        laws = ", ".join(law.coordinate.text for law in self.setup.laws)
        text = (
            f"the law of {laws} drives joint {name} into its {stop} (S4)" if laws else
            f"joint {name} meets its {stop} where no freedom moves it, at a dead centre (S4): the "
            "impulse of this impact has no bound"
        )  # fmt: skip
        return NoWay(text, "jammed", "S4", joints=[name])

    def _still(self, contact: int) -> float:
        """Return the speed of a gap up to which it has none."""
        return float(STILL * self._fast * self.sizes[contact])

    def _close(
        self, t: float, x: Unknowns, v: Floats, resting: list[int], released: int | None
    ) -> None:
        """Close those contacts without speed that are pressed; in doubt those a moment later."""
        closed, sure = self._pressed((t, x, v), resting)
        if released in resting or not sure:
            a = self.integrator.acceleration(t, x, v, self.setup.loose)
            for share in SOON:
                h = share * self.setup.end
                later = (t + h, x + h * v + h * h / 2 * a, v + h * a)
                closed, sure = self._pressed(later, resting)
                if sure:
                    break
            else:
                closed[[] if released is None else [released]] = 0.0
        self.setup.closed = closed

    def _pressed(
        self, at: tuple[float, Unknowns, Floats], resting: list[int]
    ) -> tuple[Floats, bool]:
        """Return which contacts are pressed at a state, by least index, and whether it is sure.

        Those that are closed push, those that are open part.
        """
        setup, natural = self.setup, self._fast**2 * self.sizes[resting]
        setup.closed = np.zeros(len(self.contacts))
        setup.closed[resting] = 1.0
        margins = np.zeros(0)
        for _ in range(4 * 2 ** min(len(resting), 16)):
            rates, held = (part[0][resting] for part in self.forces(*at, setup.loose))
            self._strongest = max(self._strongest, float(np.abs(held).max(initial=0.0)))
            strong = np.abs(held) > self._none[resting]
            pushes = np.where(strong, held, 0.0) / max(self._strongest, TINY)
            margins = np.where(setup.closed[resting] > 0, pushes, rates / natural)
            wrong = np.flatnonzero(margins < -DOUBT)
            if not len(wrong):
                break
            setup.closed[resting[wrong[0]]] = 1.0 - setup.closed[resting[wrong[0]]]
        return setup.closed, bool((margins > SURE * DOUBT).all())

    def _taken(self, w: Floats, hit: Hit) -> Floats:
        """Return works with what impacts take, and what drivers put into them."""
        w, names = w.copy(), self.setup.works
        for contact, work in zip(hit.touching.tolist(), hit.works, strict=True):
            w[names.index(f"{IMPACTS}.{self.contacts[contact].owner}")] += work
        if self.setup.laws:
            w[names.index(DRIVERS)] += hit.gained - float(np.sum(hit.works))
        return w

    def _note(self, t: float, hit: Hit, before: Floats, low: Mapping[int, float]) -> None:
        """Keep the events of an instant; rebounds that are left out would last for times `low`."""
        first = len(self.found)
        for j, i in enumerate(hit.touching.tolist()):
            one, speed = self.contacts[i], float(-hit.before[j])
            who = {"joint": one.owner, "end": one.end}
            if speed > self._still(i) and hit.impulses[j]:
                self.rebounds[i] += 1
                facts = {
                    "speed": speed, "rebound": float(hit.after[j]), "unit": one.unit,
                    "impulse": float(hit.impulses[j]), "work": float(hit.works[j]),
                }  # fmt: skip
                sure = {} if hit.unique else {"unique": False}
                self.found.append(motion_event("impact", t, **who, **facts, **sure))
            if self.setup.closed[i] and not before[i]:
                left = {"left_out": low[i]} if np.isfinite(low.get(i, np.inf)) else {}
                self.found.append(motion_event("contact", t, **who, **left))
                if left:
                    self._notes.setdefault(
                        (one.owner, one.end),
                        f"joint {one.owner}: rebounds from its contact ({one.end}) lower than "
                        f"{LOW:g} of its size are left out: it stays closed from t = {t:.9g} s on "
                        f"after {self.rebounds[i]} impacts, the others would take {low[i]:.2g} s",
                    )
            elif before[i] and not self.setup.closed[i]:
                self.found.append(motion_event("release", t, **who))
        if float(np.sum(hit.works)) > CLOSE * float(np.abs(hit.works).sum()):
            self._notes.setdefault(
                ("", "energy"),
                f"the impact at t = {t:.9g} s adds {float(np.sum(hit.works)):.3g} J: with friction "
                'the law of Newton may do so, impact = "poisson" does not',
            )
        if not hit.unique and any(event["kind"] == "impact" for event in self.found[first:]):
            names = ", ".join(dict.fromkeys(self.contacts[i].owner for i in hit.touching))
            self._notes.setdefault(
                (names, "order"),
                f"at t = {t:.9g} s several contacts of {names} touch at once, and impacts one "
                "after the other would lead elsewhere: the outcome is not unique; it is that of "
                f"the law of {self.law.capitalize()} for all at once",
            )

    # -- the result ----------------------------------------------------------------------------

    def notes(self) -> list[str]:
        """Return what there is to say."""
        return list(self._notes.values())

    def series(self, states: States, forces: Determined) -> dict[str, dict[str, Floats | LazyPart]]:
        """Return by joint the gap to the nearer contact and the force of contacts, (n,) each.

        The force is positive along the joint's coordinate, nan where it is not unique.
        """
        k, r = self.kernel, self.setup.released
        gaps = k.batch("gaps", lambda: k.function("gaps", [ca.densify(r.gaps_of_contacts)]), ())
        gap = gaps(states.t[:, None], states.x, states.v, states.signs)[0] - self.turns
        force = -states.lam[:, k.m + self.count : k.m + k.slips]
        found: dict[str, dict[str, Floats | LazyPart]] = {}

        def pushed(word: str, ends: list[int], signs: Floats) -> LazyPart:
            def sole() -> dict[str, Floats]:
                lost = forces.sole.contacts[:, ends].any(axis=1)
                return {word: np.where(lost, np.nan, force[:, ends] @ signs)}

            return LazyPart(sole)

        for name, unit in dict.fromkeys((c.owner, c.unit) for c in self.contacts):
            ends = [i for i, c in enumerate(self.contacts) if (c.owner, c.unit) == (name, unit)]
            signs = np.array([self.contacts[i].sign for i in ends])
            nearest = gap[:, ends].min(axis=1)
            if self.contacts[ends[0]].end == BUSH:  # of the offset, see `gaps`
                c = self.setup.model.mechanism.values()[f"{name}.clearance"]
                nearest = c - np.sqrt(np.maximum(c * c - 2 * c * nearest, 0.0))
            gap_of, force_of = (
                ("gap_angle", "contact_moment") if unit == "rad" else ("gap", "contact_force")
            )
            found.setdefault(name, {})[gap_of] = nearest
            found[name][force_of] = pushed(force_of, ends, signs)
        return found
