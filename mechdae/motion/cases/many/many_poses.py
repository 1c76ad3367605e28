"""Many poses of a path in blocks that stay near the processor: solved, certified, bounded there.

A block is tested as a whole, by the largest step and the largest inverse in it; poses that do not
pass, and those near limits and change points, are left to the evaluator.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.machine.line import CompiledLine
from mechdae.kernels.run.columns import PoseColumns, StoreLayout
from mechdae.kernels.run.numpy_backend import PoseLine, straight
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.beyond_ends import HALF_TURN
from mechdae.motion.continuation.evaluate import CARRIED, H_LIMIT, Evaluator, Poses, Rates, in_time
from mechdae.motion.continuation.output_bounds import ILL, OutputBounds, plain_up_to, spread_of
from mechdae.motion.continuation.path import SMALLEST, Path
from mechdae.motion.setup.outputs import Outputs
from mechdae.types import Booleans, Floats, Integers, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.run.columns import PoseTable

X, ERROR, DET, BETA, ETA, Y = range(6)
"""Numbers of the pose kernel's outputs."""
TWICE = 3
"""Times that a block is solved again as a whole."""
MOST_ALONE = 8
"""One pose in so many may be left over, or the whole block is solved again."""


def in_blocks(
    evaluator: Evaluator, path: AnyPath, s: Floats, rates: Rates, timed: list[float] | None
) -> Poses | None:
    """Return many poses with their bounds, None where they are to be evaluated one by one."""
    if not isinstance(path, Path) or (timed is not None and any(timed[1:])):
        return None
    closing = evaluator.closing
    if evaluator.graphs.contacts or (closing is not None and closing.checks):
        return None
    line = lean_line(evaluator.graphs, evaluator.outputs)
    if line is None:
        return None
    return ManyPoses(evaluator, line, path, s, rates, None if timed is None else timed[0]).run()


def lean_line(graphs: Graphs, outputs: Outputs) -> PoseLine | None:
    """Return the pose kernel without what no result shows."""
    orders = range(1, graphs.derivatives + 1)
    unshown = {(Y + k, i) for k in orders for i in outputs.without_rates}
    shared = [graphs.pose.n_in() - 1]
    made = graphs.pose, shared, unshown
    return graphs.cache("lean", lambda: CompiledLine.of(*made) or straight(*made))


def chunk_of(line: PoseLine) -> int:
    """Return how many poses are evaluated at once."""
    return line.chunk


class ManyPoses:
    """The poses of a path at `s`; `speed` is that of the driver by which y is differentiated."""

    def __init__(
        self,
        evaluator: Evaluator,
        line: PoseLine,
        path: Path,
        s: Floats,
        rates: Rates,
        speed: float | None,
    ) -> None:
        self.evaluator, self.line, self.path, self.s = evaluator, line, path, s
        self.graphs, self.constants = evaluator.graphs, path.constants
        self.rates, self.speed = rates, 1.0 if speed is None else speed
        timed = speed is not None
        self.layout: StoreLayout = self.graphs.cache(("layout", timed), lambda: self._layout(timed))
        g = self.graphs
        consts = self.constants.consts
        if g.single:
            self.inputs: list[Floats] = [np.empty((g.nx, 0)), s[None, :], consts]
        else:
            full = evaluator.all_rates(path, s, rates)
            moved = [path.drivers(s), *full]
            self.inputs = [np.empty((g.nx, 0)), *[part.T for part in moved], consts]
        self.scalars: list[float] = line.scalars(self.inputs)
        self.table: PoseTable = self.layout.table(len(s), self.inputs, self.scalars, self.speed)
        self.bounder: OutputBounds = OutputBounds(g, evaluator.outputs, self.constants)
        self.bounds: dict[str, Floats] = {word: np.empty(len(s)) for word in self.bounder.words}
        self.condition: Floats = np.ones(len(s))
        self.between: tuple[float, float] = places_between(path)
        self.flips: bool = any(path.flips)

    def _layout(self, timed: bool) -> StoreLayout:
        g = self.graphs
        groups = [entry.columns for entry in self.evaluator.outputs.entries]
        known = [(X, 0, [tuple(range(g.nx))])]
        known += [(Y + k, k, groups) for k in range(g.derivatives + 1)]
        return StoreLayout(self.line, known, timed)

    def run(self) -> Poses:
        n, size = len(self.s), chunk_of(self.line)
        left = [key for key in self.line.results if key not in self.layout.target]
        rows = np.empty((len(left), min(n, size)))
        self.scratch: dict[tuple[int, int], Floats] = dict(zip(left, rows, strict=True))
        odd = [self._block(a, min(a + size, n)) for a in range(0, n, size)]
        self.evaluator.pose.evaluations += n
        rest = np.concatenate(odd)
        first, *spans = self.layout.spans
        x, y = None, [PoseColumns(self.table, *span) for span in spans]
        shape = (n, len(self.evaluator.groups))
        alive, nothing = np.broadcast_to(True, shape), np.broadcast_to(False, n)
        poses = Poses(self.s, self.s, x, alive, nothing, nothing, nothing, None, self.condition, y)
        bounds = self.bounds
        poses.bounds = lambda: bounds
        poses.fine = not rest.size
        if rest.size:
            self._put(poses, rest)
        poses.x = np.asarray(PoseColumns(self.table, *first))
        return poses

    def _put(self, poses: Poses, rows: Integers) -> None:
        """Evaluate some poses one by one and write them."""
        rates = tuple(np.broadcast_to(r, (len(self.s), self.graphs.nu))[rows] for r in self.rates)
        part = self.evaluator.at(self.path, self.s[rows], rates)
        y = in_time(part.y, self.speed, 0.0) if self.layout.timed else part.y
        self.table.write(rows, np.hstack([part.x, *y]))
        for word, bound in self.bounder.by_kind(part.error.T).items():
            self.bounds[word][rows] = bound
        self.condition[rows] = part.condition
        poses.places = self.s.copy()
        for name in ("alive", "places", "at_limit", "uncertain", "singular"):
            whole = np.array(getattr(poses, name))
            whole[rows] = getattr(part, name)
            setattr(poses, name, whole)

    def _block(self, a: int, b: int) -> Any:
        """Evaluate the poses from a to b; return the numbers of those that are left over."""
        g, layout, some = self.graphs, self.layout, slice(a, b)
        s, store = self.s[some], self.table.store[:, some]
        shared = self.line.shared
        inputs = [p if i in shared else p[:, some] for i, p in enumerate(self.inputs)]
        into = {slot: row[: b - a] for slot, row in self.scratch.items()}
        into |= {slot: store[row] for slot, row in layout.target.items()}

        def values(output: int, count: int) -> Any:
            places = (self.line.places[output, i] for i in range(count))
            return [self.line.value(place, inputs, self.scalars, into) for place in places]

        guess = inputs[0] = self.path.guess(s).T
        first: Any = True
        for times in range(TWICE + 1):
            self.line.block(inputs, self.scalars, into)
            beta, eta = values(BETA, g.nb), values(ETA, g.nb)
            most = [(np.max(beta[k]), np.max(eta[k])) for k in range(g.nb)]
            if not times:
                first = self._first(beta, eta, most)
            again = self._again(beta, eta, most)
            if again is None or times == TWICE or MOST_ALONE * np.count_nonzero(again) < b - a:
                break
            self.evaluator.refined += b - a
            self.evaluator.pose.evaluations += b - a
            inputs[0] = np.array(values(X, g.nx))
        x = values(X, g.nx)
        tests = [first, self._good(s, x, values(DET, g.nb), (beta, eta), most), self._ordinary(s)]
        if times:
            tests.append(self._near(guess, x))
        if again is not None:
            tests.append(~again)
        failed = [test for test in tests if test is not True]
        good: Any = np.logical_and.reduce(failed) if failed else True
        error = values(ERROR, g.nx)
        for word, bound in self.bounds.items():
            self.bounder.of_kind(word, error, bound[some])
        condition = self.condition[some]
        for k in range(g.nb):
            np.maximum(condition, self.constants.mu[k] * beta[k], out=condition)
        if layout.timed:
            layout.rates(store, inputs, self.speed)
        return np.zeros(0, int) if good is True else a + np.flatnonzero(~good)

    # -- tests: True where all poses pass by the largest numbers among them, else (n,) ----------

    @np.errstate(invalid="ignore", over="ignore")
    def _first(
        self, beta: list[Floats | float], eta: list[Floats], most: list[tuple[float, float]]
    ) -> bool:
        """Return which poses are certified from their guesses, or told by the sign alone."""
        result: bool = True
        tells = self.evaluator.sign_tells
        for k in np.flatnonzero(~tells):
            kappa, (b, e) = self.constants.kappa[k], most[k]
            if not kappa * b * np.sqrt(e) <= H_LIMIT:
                result = result & (kappa * beta[k] * np.sqrt(eta[k]) <= H_LIMIT)
        return result

    @np.errstate(invalid="ignore", over="ignore")
    def _again(
        self, beta: list[Floats | float], eta: list[Floats], most: Sequence[tuple[float, float]]
    ) -> Booleans | None:
        """Return which poses are to be solved again, None where no one is."""
        result: Booleans | None = None
        tiny = self.evaluator.tiny(self.constants)
        for k in range(self.graphs.nb):
            kappa, (b, e) = self.constants.kappa[k], most[k]
            wide = CARRIED if self.evaluator.turning[k] else np.inf
            if kappa * b * e <= tiny[k] and e <= wide:
                continue
            refine = (kappa * beta[k] * eta[k] > tiny[k]) | (eta[k] > wide)
            result = refine if result is None else result | refine
        return result if result is not None and np.any(result) else None

    @np.errstate(invalid="ignore", over="ignore")
    def _good(
        self,
        s: Floats,
        x: list[Unknowns],
        det: list[Floats],
        sizes: Any,
        most: Sequence[tuple[float, float]],
    ) -> Booleans | bool:
        """Return which poses are certified to be on the path's branch."""
        result: Booleans | bool = True
        beta, eta = sizes
        signs = self.path.sign_at(s).T if self.flips else self.path.sign[:, None]
        for k in range(self.graphs.nb):
            kappa, rho, (b, e) = self.constants.kappa[k], self.constants.rho[k], most[k]
            if not kappa * b * np.sqrt(e) + kappa * b**2 * rho <= H_LIMIT:
                h = kappa * beta[k] * np.sqrt(eta[k]) + kappa * beta[k] ** 2 * rho
                result = result & (h <= H_LIMIT)
            if not self.constants.mu[k] * b <= plain_up_to(self.graphs, k):
                spread = spread_of(self.graphs, self.constants, k, det[k], beta[k])
                result = result & (spread <= ILL)
            sign = signs[k]
            least = np.min(det[k]) if sign[0] > 0 else -np.max(det[k])
            if self.flips or not (sign[0] and least > 0):
                result = result & (np.sign(det[k]) == sign)
        for i, size in enumerate(self.constants.size_x):
            if not (np.max(x[i]) <= size and np.min(x[i]) >= -size):
                result = result & (np.abs(x[i]) <= size)
        return result

    def _near(self, guess: Unknowns, x: list[Unknowns]) -> Any:
        """Return at which poses no angle has left its guess by far."""
        angles = np.flatnonzero(self.evaluator.angles)
        with np.errstate(invalid="ignore"):
            return np.all([np.abs(x[i] - guess[i]) <= HALF_TURN for i in angles], axis=0)

    def _ordinary(self, s: Floats) -> Booleans | bool:
        """Return which places are away from limits and change points."""
        low, high = self.between
        result: Booleans | bool = True
        if not (np.min(s) >= low and np.max(s) <= high):
            result = (s >= low) & (s <= high)
        if self.path.zones:
            result = result & (self.path.zone_at(s) < 0)
        return result


def places_between(path: Path) -> tuple[float, float]:
    """Return an interval within which all groups follow a path, away from their ends."""
    low, high = path.extent if path.followed else (-np.inf, np.inf)
    for reach in path.reach.values():
        for end, way in ((reach.low, 1.0), (reach.high, -1.0)):
            if end is None:
                continue
            slack = 16 * np.finfo(float).eps * Evaluator.coarse(path, end.s)
            slack += 8 * SMALLEST * path.largest
            slack += 2 * abs(end.s - (end.s if end.reached is None else end.reached))
            if way > 0:
                low = max(low, end.s + slack)
            else:
                high = min(high, end.s - slack)
    return low, high
