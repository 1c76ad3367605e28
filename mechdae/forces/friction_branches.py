"""Which solution of friction continues the one without friction, and where it ends.

It is followed by growing all coefficients of friction from zero, of many poses at once, each with
steps of its own; where it ends is the critical factor.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from mechdae.forces.friction_solutions import (
    SAME,
    apart,
    forms_of,
    newton,
    sized,
    slopes_of,
    solutions_of,
)
from mechdae.kernels.graphs.kinetostatics import Balance
from mechdae.kernels.run.functions import Batch
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Matrices, Points

FINEST, ROUGH = 1e-10, 1e-6
"""Shares to which critical factors are found: of poses that jam, of margins."""
FIRST = 1 / 16
ROUNDS = 400
"""Steps by which a solution is followed at most."""


@dataclass
class FrictionSolutions:
    """Solutions at one pose: sizes (k, feedbacks), which continues from no friction.

    ``connected`` is its place or None; ``critical`` the factor on all coefficients of friction
    at which it ends, None where it was not looked for or does not end; ``joint`` is the one
    whose friction ends it.
    """

    sizes: Floats
    proven: bool
    connected: int | None = None
    critical: float | None = None
    joint: str = ""


@dataclass(frozen=True)
class Stage:
    """Linear forms of the friction of a group at poses: start + slope m of its own sizes m.

    ``places`` and ``laws`` of the sizes, ``start`` (n, rows), ``slope`` (n, rows, sizes) of each.
    """

    places: list[int]
    laws: list[str]
    start: list[Points]
    slope: list[Matrices]

    def forms(self, sizes: Floats) -> list[Points]:
        """Return the forms (n, rows) of each for sizes (n, feedbacks)."""
        return forms_of(self.start, self.slope, sizes[:, self.places])

    def slopes(self, sizes: Floats) -> Floats:
        """Return d size / d m, (n, k, k), at sizes (n, feedbacks)."""
        return slopes_of(self.laws, self.start, self.slope, sizes[:, self.places])


@dataclass
class Grown:
    """Solutions followed from no friction at poses (n,).

    ``factor`` is the largest on all coefficients of friction that was reached, ``sizes``
    (n, feedbacks) are those there; where what was asked for is not ``reached``, ``joints`` names
    the joint whose friction feeds itself most. Those that are ``open`` have not ended, but the
    `ROUNDS` of their steps have.
    """

    factor: Floats
    sizes: Floats
    reached: Booleans
    open: Booleans
    joints: list[str]


def some(inputs: Sequence[Floats], rows: Integers | list[int] | slice) -> list[Floats]:
    """Return the inputs of the balance at some of the poses."""
    return [array[rows] if array.ndim == 2 else array for array in inputs]


class Branches:
    """Solutions of a balance at poses.

    Parameters
    ----------
    balance
        The forces in symbols.
    stages
        `Balance.stages` for many poses.
    by_factor
        The same with a factor on friction for each pose.
    """

    def __init__(self, balance: Balance, stages: Batch, by_factor: Batch) -> None:
        self._stages, self._by_factor = stages, by_factor
        self.balance: Balance = balance
        self.groups: list[tuple[list[int], list[slice], list[str]]] = []
        for share in balance.shares:
            if share.feedbacks:
                laws = [balance.feedbacks[k].law for k in share.feedbacks]
                self.groups.append((share.feedbacks, share.forms, laws))

    def at(self, inputs: Sequence[Floats], critical: bool = True) -> list[FrictionSolutions]:
        """Return the solutions at poses; inputs are those of the balance.

        Without solutions the critical factor is looked for only if asked.
        """
        every = [self._all(some(inputs, slice(k, k + 1))) for k in range(len(inputs[0]))]
        sure = [len(solutions) == 1 and proven for solutions, proven in every]
        wanted = [
            k
            for k, (solutions, proven) in enumerate(every)
            if not sure[k] and (solutions or critical or not proven)
        ]
        grown = self._grown(some(inputs, wanted), 1.0, FINEST) if wanted else None
        place = {k: i for i, k in enumerate(wanted)}
        return [
            self._answer(*solutions, 0 if sure[k] else None, grown, place.get(k))
            for k, solutions in enumerate(every)
        ]

    def _answer(
        self, solutions: list[Floats], proven: bool, connected: int | None,
        grown: Grown | None, i: int | None,
    ) -> FrictionSolutions:  # fmt: skip
        """Return the solutions of a pose, `i` among those that were `grown`."""
        factor, joint = None, ""
        if grown is not None and i is not None:
            if not grown.reached[i] and not grown.open[i]:
                factor, joint = float(grown.factor[i]), grown.joints[i]
            elif grown.reached[i]:
                last = grown.sizes[i]
                gaps = [apart(solution, last) for solution in solutions]
                if not gaps or min(gaps) > SAME:
                    solutions, gaps = [*solutions, last], [*gaps, 0.0]
                connected = int(np.argmin(gaps))
        sizes = np.array(solutions).reshape(len(solutions), len(self.balance.feedbacks))
        return FrictionSolutions(sizes, proven, connected, factor, joint)

    # -- all solutions -----------------------------------------------------------------------

    def _all(self, inputs: Sequence[Floats]) -> tuple[list[Floats], bool]:
        """Return all solutions at one pose, and whether their count is proved."""
        proven = True
        fronts = [np.zeros(len(self.balance.feedbacks))]
        for g, (places, _, _) in enumerate(self.groups):
            following = []
            for sizes in fronts:
                start, slope = self._forms(self._group(inputs, sizes[None], g), 0)
                group_sizes, sure = solutions_of(self.groups[g][2], start, slope)
                proven &= sure
                for m in group_sizes:
                    whole = sizes.copy()
                    whole[places] = m
                    following.append(whole)
            fronts = following
        return fronts, proven

    def staged(self, inputs: Sequence[Floats], sizes: Floats) -> Iterator[Stage]:
        """Yield the linear forms of each group at poses, given the sizes of the others.

        The factor on friction is one for all poses (1,), or each pose's own (n, 1).
        """
        stages = self._by_factor if inputs[-1].ndim == 2 else self._stages
        starts, slopes = stages(*inputs, sizes)
        first, second = 0, 0
        for places, forms, laws in self.groups:
            rows, k = sum(s.stop - s.start for s in forms), len(places)
            start = starts[:, first : first + rows]
            slope = slopes[:, second : second + rows * k].reshape(-1, k, rows).transpose(0, 2, 1)
            yield Stage(places, laws, [start[:, s] for s in forms], [slope[:, s] for s in forms])
            first, second = first + rows, second + rows * k

    def _group(self, inputs: Sequence[Floats], sizes: Floats, g: int) -> Stage:
        """Return the linear forms of one group at poses."""
        return next(itertools.islice(self.staged(inputs, sizes), g, None))

    @staticmethod
    def _forms(stage: Stage, row: int) -> tuple[list[Floats], list[Floats]]:
        """Return forms without own sizes, and their slopes, at one pose: [j] (k,), [j] (k, own)."""
        return [forms[row] for forms in stage.start], [forms[row] for forms in stage.slope]

    # -- the one that continues from no friction -----------------------------------------------

    def limits(
        self, inputs: Sequence[Floats], most: float
    ) -> list[tuple[float | None, str, float]]:
        """Return factors on friction at which the solutions of poses end, joints, how far it went.

        The factor is None where a solution does not end up to there, to `most` or to the last of
        `ROUNDS` steps.
        """
        grown = self._grown(inputs, most, ROUGH)
        goes_on = grown.reached | grown.open
        return [
            (None if goes_on[k] else far, grown.joints[k], far)
            for k, far in enumerate(grown.factor.tolist())
        ]

    def _grown(self, inputs: Sequence[Floats], to: float, finest: float) -> Grown:
        """Follow the solutions of poses from no friction to a factor on it.

        Where the sizes of the last step lead to none the same forces of friction are tried, that
        is smaller sizes: these fall where more friction bears its load ever better.
        """
        n = len(inputs[0])
        factor, step = np.zeros(n), np.full(n, FIRST)
        sizes, begun = self._follow(inputs, factor, np.zeros((n, len(self.balance.feedbacks))))
        going = np.flatnonzero(begun)
        for _ in range(ROUNDS):
            if not len(going):
                break
            ahead = np.minimum(to, factor[going] + step[going])
            after, there = self._follow(some(inputs, going), ahead, sizes[going])
            again = np.flatnonzero(~there)
            if len(again):
                share = (factor[going] / ahead)[again, None]
                short = some(inputs, going[again])
                after[again], there[again] = self._follow(
                    short, ahead[again], share * sizes[going[again]]
                )
            step[going] = np.where(there, 2.0, 0.5) * (ahead - factor[going])
            factor[going[there]], sizes[going[there]] = ahead[there], after[there]
            fine = step[going] < finest * np.maximum(1.0, factor[going])
            going = going[np.where(there, factor[going] < to, ~fine)]
        reached, open_ = begun & (factor >= to), np.isin(np.arange(n), going)
        joints = [""] * n
        for k in np.flatnonzero(begun & ~reached & ~open_):
            joints[k] = self._culprit(some(inputs, slice(k, k + 1)), factor[k], sizes[k])
        return Grown(factor, sizes, reached, open_, joints)

    def _culprit(self, inputs: Sequence[Floats], factor: float, sizes: Floats) -> str:
        """Return the joint whose friction takes the largest part in what makes the sizes grow.

        With G the slopes of the sizes and x, y the right and left vectors of its eigenvalue 1
        y_j x_j / y x is the share by which that eigenvalue grows with the friction of joint j.
        """
        scaled = [*inputs[:-1], np.array([factor])]
        worst, joint = np.inf, ""
        for stage in self.staged(scaled, sizes[None]):
            values, vectors = np.linalg.eig(stage.slopes(sizes[None])[0])
            nearest = int(np.argmin(np.abs(values - 1)))
            if abs(values[nearest] - 1) < worst:
                worst = float(abs(values[nearest] - 1))
                left = np.linalg.pinv(vectors)[nearest]
                shares = np.abs(left * vectors[:, nearest])
                joint = self.balance.feedbacks[stage.places[int(np.argmax(shares))]].joint
        return joint

    def _follow(
        self, inputs: Sequence[Floats], factor: Floats, sizes: Floats
    ) -> tuple[Floats, Booleans]:
        """Return sizes (n, feedbacks) for factors (n,) near known ones, and which exist (n,)."""
        scaled = [*inputs[:-1], np.asarray(factor)[:, None]]
        whole, rows = sizes.copy(), np.arange(len(sizes))
        for g, (places, _, laws) in enumerate(self.groups):
            stage = self._group(some(scaled, rows), whole[rows], g)
            m, good = newton(laws, stage.start, stage.slope, whole[rows][:, places])
            start, slope = ([forms[good] for forms in each] for each in (stage.start, stage.slope))
            m, rows = m[good], rows[good]
            whole[rows[:, None], places] = m
            firm = np.linalg.det(np.eye(len(places)) - slopes_of(laws, start, slope, m)) > 0
            rows = rows[firm & (m[:, sized(laws)] >= 0).all(axis=1)]
        there = np.zeros(len(sizes), bool)
        there[rows] = True
        return whole, there
