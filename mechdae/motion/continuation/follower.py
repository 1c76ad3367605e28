"""A path is followed in steps that are each proved by the test of `Graphs.advance`.

A step that fails is halved. Where steps shrink, cases are asked for a way past what lies ahead
(`obstacles`): a change point is crossed, at a limit position the group ends and the others go on.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from mechdae.additions import of_cases
from mechdae.errors import InputError, SolveError
from mechdae.kernels.graphs.steps import STRIDE
from mechdae.motion.continuation.path import APPROACH, SHRUNK, Path, Tries
from mechdae.types import Booleans, Floats

if TYPE_CHECKING:
    from mechdae.motion.continuation.limit_positions import Limit

NEARLY = 1 + 1e-9
"""How much longer a step may be in order to end at its goal."""
FEW = 8
"""Steps that are taken in one call where they were shorter before."""
MOST_STEPS = 1_000_000
"""Steps of a path: some 8000 turns of a driver, or 1 GB of a four-bar's nodes."""


class Front:
    """The upper or the lower end of a path.

    Attributes
    ----------
    sense : float
        1 upwards, -1 downwards.
    ended : set of int
        Groups that go no further there.
    alive : (nb,) array
        Which blocks belong to groups that have not ended.
    """

    def __init__(self, path: Path, up: bool) -> None:
        self.path: Path = path
        self.up: bool = up
        self.sense: float = 1.0 if up else -1.0
        ends = {i: reach.high if up else reach.low for i, reach in path.reach.items()}
        self.ended: set[int] = {i for i, end in ends.items() if end}
        self.alive: Booleans = path.alive(self.ended)

    @property
    def s(self) -> float:
        """Place of the last node."""
        return self.path.s[-1] if self.up else self.path.s[0]

    @property
    def state(self) -> Floats:
        """The last node."""
        return self.path.state[-1] if self.up else self.path.state[0]

    @property
    def x(self) -> Floats:
        """Unknowns (nx,) of the last node."""
        return self.state[: self.path.graphs.nx]

    @property
    def sign(self) -> Floats:
        """Signs of the blocks' determinants."""
        return self.path.front[self.up]

    def append(self, s: float, state: Floats) -> None:
        """Put a node behind the last one."""
        self.path.append(s, state, self.up)

    def step(self, step: float) -> tuple[Floats, Booleans]:
        """Return the state after a step, and which blocks (nb,) it is proved for."""
        path, ds, s, state, sign = self.path, self.sense * step, self.s, self.state, self.sign
        after, test, det, miss = path.step(state, s, ds)
        if path.quintics is None:
            return after, path.proved(after, test, det, miss, sign)
        places, tests = np.array([s, s + ds]), (test[None], det[None], miss[None])
        return after, path.proved_between(places, state, after[None], tests, sign)[0]

    def end(self, limit: Limit) -> None:
        """Record that a group, and the groups attached to it, go no further."""
        for index in self.path.hanging(limit.group) - self.ended:
            self.ended.add(index)
            if self.up:
                self.path.reach[index].high = limit
            else:
                self.path.reach[index].low = limit
        self.alive = self.path.alive(self.ended)

    def leave_curves(self) -> None:
        """End groups whose contact left an open curve since the last call."""
        curves = self.path.curves
        for limit in curves.left(self.path, self.up) if curves is not None else ():
            for index in self.path.hanging(limit.group):
                reach = self.path.reach[index]
                if self.up and (reach.high is None or reach.high.s > limit.s):
                    reach.high = limit
                elif not self.up and (reach.low is None or reach.low.s < limit.s):
                    reach.low = limit
                self.ended.add(index)
            self.alive = self.path.alive(self.ended)


def extend(path: Path, to: float, needed: Iterable[int] | None = None, first: bool = False) -> None:
    """Follow a path until `to`, or until all `needed` groups have ended.

    With `first` it ends with the first of them. A limit position may be proved from afar;
    the other groups are then followed as far, and may end before.

    Raises
    ------
    SolveError
        The path has no start.
    InputError
        More than `MOST_STEPS` steps.
    """
    if not path.s:
        raise SolveError("the path has no start")
    up = to > path.s[-1]
    if not up and to >= path.s[0]:
        return
    front = Front(path, up)
    sense = front.sense
    path.began = front.s
    steps = len(path.s) + sense * (to - path.began) / path.largest
    if steps > MOST_STEPS and path.followed:
        raise InputError(
            f"the motion takes {steps:.2g} steps, at most {MOST_STEPS} are followed",
            hint="a driver goes far: numbers without a suffix are radians, metres and seconds",
        )
    wanted = set(path.followed if needed is None else needed)
    step = path.largest
    while True:
        front.leave_curves()
        if not wanted - front.ended:
            return
        goal, rest = to, sense * (to - front.s)
        if first and wanted & front.ended:
            rest = _until_first(front, wanted & front.ended)
            goal = front.s + sense * rest
        if rest <= 0:
            return
        if rest > 4 * step and step >= SHRUNK * path.largest:
            count = int(min(STRIDE, rest / step - 0.5))  # what is left is no rounding
            held = _stride(front, sense * step, count)
            if held:
                step = min(2 * step, path.largest) if held > 4 else step / 2
                continue
        step = _careful(front, min(step, rest), goal)


def _until_first(front: Front, ended: set[int]) -> float:
    """Return how far ahead the first end of groups lies, 0 where the path meets it."""
    reach = [front.path.reach[index] for index in ended]
    found = [r.high if front.up else r.low for r in reach]
    rest = min(front.sense * (end.s - front.s) for end in found if end is not None)
    return rest if rest > 2 * APPROACH * front.path.largest else 0.0


def _stride(front: Front, ds: float, count: int) -> int:
    """Take up to `count` equal steps in one call; return how many were proved."""
    path, alive, sign, state = front.path, front.alive, front.sign, front.state
    places, chain, held = front.s + ds * np.arange(count + 1), path.graphs.strides, 0
    ahead = min(count, FEW) if abs(ds) < path.largest else count  # the next may fail as well
    while True:
        some = places[held : held + ahead]
        states, test, det, miss = chain(state, some, ds, path.whole, ahead)
        between = places[held : held + ahead + 1]
        proved = path.proved_between(between, state, states, (test, det, miss), sign)
        good = proved[:, alive].all(axis=1)
        taken = ahead if good.all() else int(np.argmin(good))
        path.append_all(
            places[held + 1 : held + taken + 1].tolist(), list(states[:taken]), front.up
        )
        held += taken
        if taken < ahead or held == count:
            break
        state = states[-1]
        ahead = count - held
    path.counts.steps += held
    if held > 4:
        path.tries.bridge.clear()
    path.counts.rejected += held < count
    return held


@np.errstate(invalid="ignore")
def _careful(front: Front, step: float, goal: float) -> float:
    """Take one step, halved until it is proved; return the step to try next.

    Towards `goal`, which is met to the last bit: steps of a rounding cannot be proved.
    """
    path, sense, alive = front.path, front.sense, front.alive
    while True:
        rest = sense * (goal - front.s)
        if rest <= 0:
            return step
        step = rest if rest < NEARLY * step else step
        after, proved = front.step(step)
        bad = (alive & ~proved).nonzero()[0]
        if not bad.size:
            path.counts.steps += 1
            front.append(goal if step == rest else front.s + sense * step, after)
            if step < SHRUNK * path.largest:
                path.tries.labour(front.s, rest - step)
            if 1.5 * step >= path.largest:
                path.tries = Tries()
            return min(1.5 * step, path.largest)
        path.counts.rejected += 1
        step /= 2
        for past in of_cases("past a step"):
            following: float | None = past(front, int(bad[0]), step, rest, goal)
            if following is not None:
                return following
