"""A motion step by step: what is watched in its steps, and how it goes on or ends."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.dynamics.endings import Growth, crawling, stalled
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.friction_sizes import Creep
from mechdae.dynamics.integrate import Cut, Integrator, Nodes, NoWay, Watcher
from mechdae.dynamics.output_values import States
from mechdae.dynamics.start import Start
from mechdae.dynamics.time_rates import Clock, StepLimit
from mechdae.dynamics.watchers.events import Crossings, Ranges, Stiffness
from mechdae.dynamics.watchers.passages import Passages
from mechdae.dynamics.watchers.sliding import Turn
from mechdae.dynamics.watchers.sticking import Sticking
from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.results import Event, motion_event
from mechdae.types import Floats, Unknowns

if TYPE_CHECKING:
    from mechdae.dynamics.contacts.touching import Touching
    from mechdae.forces.one_sided.lift_off import Lifting

MOST = 400_000
"""States that are kept."""
CROWD = 20
"""Events of friction of one pair so near each other that the motion does not go on."""
CLOSE = 1e-6
"""Share of the whole time that is near."""
STEPS = 50_000_000
"""Steps, rejected ones too, after which a motion ends."""


@dataclass
class MotionRun:
    """What an integration gave.

    ``watchers`` look at all accepted steps in this order, each up to where the one before it cut
    them; ``turns`` are the times and pairs of events of friction, ``last`` is the last state,
    ``ends`` the event with which a motion ends before its time, ``fault`` what is said of it.
    """

    setup: MotionProblem
    begin: Start
    integrator: Integrator
    watchers: list[Watcher] = field(init=False)
    creep: Creep | None = None
    first_energy: float = 0.0
    states: States = field(init=False)
    last: Any = None
    last_signs: Floats | None = None
    rests: float | None = None
    fault: str | None = None
    ends: Event | None = None
    marks: list[tuple[Floats, Floats]] = field(default_factory=list)
    undecided: tuple[float, str] = (-1.0, "")
    turns: list[tuple[float, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        parts = (self.setup, self.integrator)
        self.sticking, self.crossings = Sticking(*parts), Crossings(*parts)
        self.growth, self.passages = Growth(*parts), Passages(*parts)
        self.stiffness, self.ranges = Stiffness(*parts), Ranges(*parts)
        self.lifting: list[Lifting] = [make(*parts) for make in self.setup.model.cases("watchers")]
        contacts = self.setup.model.cases("touching") if self.setup.unilateral else []
        self.touching: list[Touching] = [make(*parts) for make in contacts]
        self.watchers = [
            self.sticking, *self.touching, self.crossings, self.growth, self.passages,
            self.stiffness, self.ranges, *self.lifting,
        ]  # fmt: skip

    def watched(self, nodes: Nodes) -> tuple[Nodes, Cut | None]:
        """Return accepted steps up to the first place where the motion does not go on, and it."""
        cut = None
        for watcher in self.watchers:
            found = watcher.look(nodes)
            if found is not None:
                nodes, cut = nodes.until(found.state), found
        if cut is not None and cut.verdict is not None:
            self.verdict(float(cut.state[0]), cut.verdict)
        if cut is not None and cut.end is not None:
            self.end(*cut.end)
        return nodes, cut

    def verdict(self, t: float, verdict: NoWay) -> None:
        """Keep why a motion ends where dry friction leaves no accelerations, or several."""
        self.undecided = (t, verdict.status)
        event = motion_event(verdict.status, t, code=verdict.code, **verdict.facts)
        self.end(f"at t = {t:.9g} s: {verdict}", event)

    def end(self, fault: str, event: Event) -> None:
        """Keep why a motion ends before its time, and the event of it."""
        self.fault = fault
        self.ends = event


@dataclass
class OutputStates:
    """States of output as they are found: time, x, v, works, signs."""

    rows: list[tuple[Any, Any, Any, Any, Any]] = field(default_factory=list)
    count: int = 0

    def add(self, t: Floats | float, x: Unknowns, v: Floats, w: Floats, signs: Any) -> None:
        """Add states (n, .)."""
        t = np.atleast_1d(np.asarray(t, float))
        self.count += len(t)
        if self.count > MOST:
            raise InputError(
                f"more than {MOST} states would be kept",
                hint="name the times: at = [...] or poses",
            )
        signs = np.broadcast_to(np.asarray(signs, float), (len(t), len(signs)))
        self.rows.append((t, *(np.atleast_2d(part) for part in (x, v, w)), signs))

    def stacked(self) -> tuple[Floats, ...]:
        return tuple(np.concatenate(parts) for parts in zip(*self.rows, strict=True))


def integrate(run: MotionRun, recorded: OutputStates, x: Any, v: Any) -> None:
    """Integrate a run from its start; keep the states of output."""
    setup, integrator, sticking = run.setup, run.integrator, run.sticking
    lay = integrator.layout
    w = np.zeros(lay.works)
    try:
        signs, v = sticking.first(0.0, x, v)
        for touching in run.touching:
            w, v, signs = touching.begin(sticking, x, v, signs)
    except NoWay as verdict:
        run.verdict(0.0, verdict)
        signs = setup.loose
    if setup.times is None or setup.times[0] == 0.0 or run.fault:
        recorded.add(0.0, x, v, w, signs)
    if run.fault:
        return
    clock = Clock(setup, x, v, run.crossings.expressions)
    state = integrator.first(0.0, x, v, w, signs)
    if clock.begin() > 0:
        state, signs = _resumed(run, state, signs, clock.begin())
    while not sticking.final(signs, *(lay.of(state, part) for part in ("t", "x", "v"))):
        stretch = clock.stretch(float(lay.of(state, "t")))
        cut = _stretched(run, recorded, state, signs, stretch)
        if cut is None and not run.fault and stretch.end < setup.end:
            state = state if run.last is None else run.last
            if stretch.bends:
                fault, t = clock.impact(stretch), stretch.end
                if fault is not None:
                    run.end(fault, motion_event("impact", t, code="S9"))
                    return
                state, signs = _resumed(run, state, signs, stretch.resume)
        elif cut is not None and cut.turn is not None:
            state, signs = _turned(run, cut.turn, signs)
            if run.fault:
                return
        elif cut is not None and cut.touch is not None:
            try:
                state, signs, end = run.touching[0].beyond(sticking, cut.touch, signs)
            except NoWay as verdict:
                run.verdict(float(lay.of(cut.touch.state, "t")), verdict)
                return
            if end is not None:
                run.end(*end)
                return
        else:
            return
    _rest(run, recorded, state, signs)


def _stretched(
    run: MotionRun, recorded: OutputStates, state: Floats, signs: Floats, stretch: StepLimit
) -> Cut | None:
    """Integrate over a stretch of time; return where the motion does not go on as it did."""
    setup, integrator, sticking = run.setup, run.integrator, run.sticking
    for nodes in integrator.steps(state, signs, stretch.end, stretch.longest):
        nodes, cut = run.watched(nodes)
        _keep(recorded, nodes, integrator, setup.times)
        run.last, run.last_signs = nodes.states[-1], nodes.signs
        if setup.laws:
            run.marks.append((nodes.states[0], nodes.signs))
        if cut is not None:
            return cut
        if nodes.stalled:
            jam = sticking.onset.ahead(run.last, nodes.signs)
            if jam is not None:
                run.verdict(float(run.last[0]), jam)
            else:
                run.end(*stalled(setup, integrator, sticking, run.last, nodes.signs))
        elif integrator.accepted + integrator.rejected > STEPS and run.last[0] < setup.end:
            run.end(*crawling(setup, integrator, run.last, STEPS))
            return None
    return None


def _turned(run: MotionRun, turn: Turn, signs: Floats) -> tuple[Any, Any]:
    """Return the state and the inputs of friction right behind an event of friction."""
    setup, integrator, sticking = run.setup, run.integrator, run.sticking
    lay, after = integrator.layout, turn.state
    t = float(lay.of(after, "t"))
    x, v, w = (after[lay[part]] for part in ("x", "v", "w"))
    before = signs
    try:
        signs, v = sticking.settled(t, x, v, sticking.sides(before), turn)
    except NoWay as verdict:
        run.verdict(t, verdict)
        return after, signs
    sticking.note(t, turn, before, signs)
    run.turns.append((t, sticking.names[turn.slip]))
    recent = [name for at, name in run.turns if t - at <= CLOSE * setup.end]
    if recent.count(recent[-1]) >= CROWD:
        owners = list(dict.fromkeys(recent))
        fault = (
            f"{len(recent)} events of dry friction (F4) of {', '.join(owners)} within "
            f"{CLOSE * setup.end:.2g} s before t = {t:.9g} s: the motion does not go on"
        )
        run.end(fault, motion_event("chatter", t, code="F4", count=len(recent), joints=owners))
        return after, signs
    state = integrator.first(t, x, v, w, signs, float(lay.of(after, "h")))
    state[lay["trials"]] = after[lay["trials"]]
    return state, signs


def _resumed(run: MotionRun, state: Floats, signs: Floats, t: float) -> tuple[Floats, Floats]:
    """Return the state and the inputs of friction right behind a breakpoint."""
    integrator, lay = run.integrator, run.integrator.layout
    run.setup.pieces = run.setup.pieces_at(t)
    signs = run.sticking.resumed(signs)
    x, v, w = (state[lay[part]] for part in ("x", "v", "w"))
    found = integrator.first(t, x, v, w, signs, float(lay.of(state, "h")))
    found[lay["trials"]] = state[lay["trials"]]
    return found, signs


def _rest(run: MotionRun, recorded: OutputStates, state: Floats, signs: Floats) -> None:
    """Keep the states of a mechanism that rests until the end."""
    setup, lay = run.setup, run.integrator.layout
    last = state.copy()
    last[lay["t"]] = setup.end
    run.last, run.last_signs = last, signs
    run.rests = float(lay.of(state, "t"))
    start = run.rests if run.rests > 0 else -1.0
    times = np.array([setup.end]) if setup.times is None else setup.times
    ahead = times[times > max(start, recorded.rows[-1][0][-1] if recorded.rows else -1.0)]
    if len(ahead):
        x, v, w = (np.tile(state[lay[part]], (len(ahead), 1)) for part in ("x", "v", "w"))
        recorded.add(ahead, x, v, w, signs)


def _keep(
    recorded: OutputStates, nodes: Nodes, integrator: Integrator, times: Floats | None
) -> None:
    """Keep the states of output inside accepted steps."""
    lay, states = integrator.layout, nodes.states
    if len(states) < 2:
        return
    first, last = float(lay.of(states[0], "t")), float(lay.of(states[-1], "t"))
    if times is None:
        nodes_behind = states[1:]
        t, x, v, w = (lay.of(nodes_behind, part) for part in ("t", "x", "v", "w"))
        recorded.add(t, x, v, w, nodes.signs)
        return
    inside = times[(times > first) & (times <= last)]
    if len(inside):
        recorded.add(inside, *integrator.between(nodes, inside), nodes.signs)
