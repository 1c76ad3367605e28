"""The certified motion of one driver as something that can be evaluated anywhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.motion.continuation.any_path import arc_of
from mechdae.motion.continuation.beyond_ends import before_limits
from mechdae.motion.continuation.evaluate import Evaluator
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.output_bounds import OutputBounds
from mechdae.motion.continuation.path import Path
from mechdae.numerics.roots import refined
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers

if TYPE_CHECKING:
    from mechdae.motion.continuation.limit_positions import Limit

TURN = 2 * np.pi
FINEST = TURN / 64
"""Largest turn of any body between two places at which a motion is sampled [rad]."""
KNOWN = 1e-13
"""Share of a radian or of the mechanism's length to which limit positions are solved."""
SAME = 1e-9
"""Share of the driver's unit within which two places are the same one."""


@dataclass(frozen=True)
class Sample:
    """Places (n,) of the path with y, y', ... (n, ny) there, derivatives by the driver."""

    s: Floats
    y: list[Floats]


Family = Callable[[Sample], tuple[Any, Any]]
"""From a sample to functions and their derivatives by the driver, (n, m) arrays."""


@dataclass(frozen=True)
class Piece:
    """An interval of the path; the sweep's driver values are `shift` more."""

    low: float
    high: float
    shift: float = 0.0


class Track:
    """A path with its evaluator.

    Parameters
    ----------
    evaluator, path
        Of one driver; rates are by the driver's value.
    values : (n,) array
        Driver values of the sweep.
    is_angle
        Whether the driver is an angle.
    scale
        A length of the mechanism [m].
    turns
        Columns of y that hold the angles of all bodies.

    Attributes
    ----------
    low, high
        Least and greatest driver value of the sweep.
    unit
        What one radian is for other drivers.
    lost
        Places at which no pose was certified.
    """

    def __init__(
        self,
        evaluator: Evaluator,
        path: Path,
        values: Floats,
        is_angle: bool,
        scale: float,
        turns: list[int],
    ) -> None:
        self.evaluator: Evaluator = evaluator
        self.path: Path = path
        self.is_angle: bool = is_angle
        self.scale: float = scale
        self.low: float = float(np.min(values))
        self.high: float = float(np.max(values))
        self.sense: float = 1.0 if len(values) < 2 or values[-1] >= values[0] else -1.0
        self.unit: float = 1.0 if is_angle else scale
        self.turns = turns
        self.lost: int = 0
        self._bounds: OutputBounds | None = None
        self._turning = {
            entry.columns[0] for entry in evaluator.outputs.entries if entry.quantity is ANGLE
        }
        self._grid = Sample(np.zeros(0), [])
        self._samples: dict[Piece, Sample] = {}
        self.margin: float = path.largest
        self.reach(self.low - self.margin, self.high + self.margin)

    def at(self, s: Floats | list[float]) -> Sample:
        """Return the quantities at places of the path."""
        poses = self.evaluator.at(self.path, np.asarray(s, float))
        return Sample(poses.s, poses.y)

    def errors(self, s: list[float], column: int) -> Floats:
        """Return how far values of a column at places (n,) may be off.

        At limit positions, which are solved for as such, that is the share `KNOWN` of a radian
        or of the mechanism's length; the bound of a pose at the rounded driver's value there
        is far above it.
        """
        if self._bounds is None:
            evaluator = self.evaluator
            graphs, outputs = evaluator.graphs, evaluator.outputs
            self._bounds = OutputBounds(graphs, outputs, self.path.constants)
        poses = self.evaluator.at(self.path, np.asarray(s, float))
        size = 1.0 if column in self._turning else self.scale
        return np.where(poses.at_limit, KNOWN * size, self._bounds.largest(poses.error, [column]))

    def reach(self, low: float, high: float) -> bool:
        """Follow the path to both places; return whether its bounds still hold there."""
        if self.path.graphs.nx:
            extend(self.path, high)
            extend(self.path, low)
        found_x, found_u = self.path.sizes()
        known = self.path.constants
        return bool(np.all(found_x <= known.size_x) and np.all(found_u <= known.size_u))

    # -- where there is motion -----------------------------------------------------------

    def ends(self) -> tuple[float, float, list[Limit]]:
        """Return the first and the last place that the driver reaches, and what ends it there."""
        arc = arc_of(self.path)
        first, last = arc.first, arc.last
        if not self.path.followed:
            first, last = -np.inf, np.inf
        if arc.low is not None:
            first = self._edge(arc.low, 1)
        if arc.high is not None:
            last = self._edge(arc.high, -1)
        return first, last, [end for end in arc.limits if end is not None]

    def _edge(self, limit: Limit, inwards: int) -> float:
        """Return the last place with a pose: the limit itself, or the node before it."""
        if limit.kind == "limit" or limit.belongs > 0:
            return limit.s
        inside = [s for s in self.path.s if (s - limit.s) * inwards > 0]
        return (min(inside) if inwards > 0 else max(inside)) if inside else limit.s

    def pieces(self, low: float, high: float) -> list[Piece]:
        """Return the parts of [low, high] that the driver reaches, whole turns aside.

        Beyond a limit position the same circuit may be reached by turning the other way
        round; those parts lie on the path whole turns away, if a turn leads to the same pose.
        """
        first, last, limits = self.ends()
        found: list[Piece] = []

        def add(bottom: float, top: float, shift: float) -> None:
            piece = Piece(max(bottom - shift, first), min(top - shift, last), shift)
            if piece.low < piece.high or (piece.low == piece.high and bottom == top):
                found.append(piece)

        add(low, high, 0.0)
        if self.is_angle and limits and arc_of(self.path).turns_back:
            if not self._comes_round(first, last):
                return sorted(found, key=lambda piece: piece.low)
            for turns in range(1, int(np.ceil((high - low) / TURN)) + 1):
                add(max([low, *[p.high + p.shift for p in found]]), high, turns * TURN)
                add(low, min([high, *[p.low + p.shift for p in found]]), -turns * TURN)
        return sorted(found, key=lambda piece: piece.low + piece.shift)

    def _comes_round(self, first: float, last: float) -> bool:
        """Return whether a whole turn of the driver leads to the same pose."""
        middle = np.array([(max(first, self.path.s[0]) + min(last, self.path.s[-1])) / 2])
        guess = self.path.guess(middle)
        return bool(self.evaluator.returns(self.path, guess, middle + TURN, middle).all())

    def sample(self, piece: Piece) -> Sample:
        """Return a sample of a piece, ends included, close enough to see every turn."""
        if piece not in self._samples:
            grid = self._grid_over(piece)
            inside = _part(grid, (grid.s > piece.low) & (grid.s < piece.high))
            beside = [s for s in before_limits(self.path) if piece.low < s < piece.high]
            near = self.at(
                [s for s in sorted({piece.low, piece.high, *beside}) if s not in inside.s]
            )
            whole = _joined(near, inside)
            self._samples[piece] = _part(whole, np.argsort(whole.s, kind="stable"))
        return self._samples[piece]

    def _grid_over(self, piece: Piece) -> Sample:
        """Return a sample of all the path, continued where the piece goes further."""
        nodes = list(self.path.s)
        if not self._grid.s.size:
            self._grid = self._fine([piece.low, *nodes, piece.high])
        first, last = self._grid.s[0], self._grid.s[-1]
        if piece.low < first:
            before = self._fine([piece.low, *[s for s in nodes if s < first], first])
            self._grid = _joined(_part(before, slice(None, -1)), self._grid)
        if piece.high > last:
            after = self._fine([last, *[s for s in nodes if s > last], piece.high])
            self._grid = _joined(self._grid, _part(after, slice(1, None)))
        return self._grid

    def _fine(self, ends: list[float]) -> Sample:
        """Return a sample between places, no step wide against a turn of any body."""
        places = np.array(sorted(set(ends)))
        places = _filled(places, np.full(len(places) - 1, self.path.largest))
        sample = self.at(places)
        if not self.turns or len(places) < 2:
            return sample
        turned = np.nan_to_num(np.abs(np.diff(sample.y[0][:, self.turns], axis=0))).max(axis=1)
        finer = _filled(places, np.diff(places) * FINEST / np.maximum(turned, FINEST))
        return sample if len(finer) == len(places) else self.at(finer)

    # -- where something vanishes ---------------------------------------------------------

    def zeros(self, piece: Piece, family: Family, moving: Booleans | None = None) -> list[Floats]:
        """Return the places at which each function of a family vanishes over a piece.

        A sign change between two samples is refined by Newton's method, held in its bracket;
        where a function turns round between samples without one, it is sampled again there.
        `moving` (m,) leaves out functions that are rounding noise.
        """
        poses = self.sample(piece)
        f, df = family(poses)

        def value(rows: Integers, columns: Integers, places: Floats) -> Any:
            return family(self.at(places))[0][np.arange(len(rows)), columns]

        _, columns, a, b, rising = brackets(poses.s, f, df, value)
        if moving is not None:
            remaining = np.asarray(moving)[columns]
            columns, a, b, rising = (part[remaining] for part in (columns, a, b, rising))
        places = self.refine(family, columns, a, b, rising)
        return [np.sort(places[(columns == k) & np.isfinite(places)]) for k in range(f.shape[1])]

    def _at_end(self, s: float) -> bool:
        """Return whether a place is where a group ends, to rounding."""
        ends = [end.s for r in self.path.reach.values() for end in (r.low, r.high) if end]
        return any(abs(s - end) <= SAME * self.unit for end in ends)

    def refine(
        self,
        family: Family,
        columns: Integers,
        a: Floats | list[float],
        b: Floats | list[float],
        rising: Booleans,
    ) -> Floats:
        """Return the zeros of functions in their brackets [a, b]; nan where one is lost."""

        def evaluate(rows: Integers, places: Floats) -> tuple[Floats, Floats]:
            which = np.arange(len(rows))
            f, df = (part[which, columns[rows]] for part in family(self.at(places)))
            return f, df

        s, lost = refined(evaluate, a, b, rising, self.unit)
        self.lost += sum(not self._at_end(place) for place in lost[np.isfinite(lost)])
        return s


def brackets(
    s: Floats,
    f: Floats,
    df: Floats,
    value: Callable[[Integers, Integers, Floats], Floats],
    joined: Booleans | bool = True,
) -> tuple[Any, ...]:
    """Return row, column, ends and sense of the sign changes of functions between neighbours.

    Those of pairs come last: a function that turns round between two samples is evaluated there.

    Parameters
    ----------
    s, f, df
        Places (n,), functions and slopes (n, m).
    value
        From rows, columns and places (k,) to values (k,).
    joined
        Which neighbours (n - 1, 1) belong to one motion.
    """
    sign = f >= 0
    with np.errstate(invalid="ignore", divide="ignore"):
        known = np.isfinite(f[:-1]) & np.isfinite(f[1:]) & joined
        dips = (f[:-1] * f[1:] > 0) & (f[:-1] * df[:-1] < 0) & (f[1:] * df[1:] > 0) & joined
        share = df[:-1] / (df[:-1] - df[1:])
    rows, columns = np.nonzero((sign[:-1] != sign[1:]) & known)
    single = rows, columns, s[rows], s[rows + 1], ~sign[rows, columns]
    rows, columns = np.nonzero(dips)
    if not rows.size:
        return single
    middle = s[rows] + share[rows, columns] * (s[rows + 1] - s[rows])
    with np.errstate(invalid="ignore"):
        there = value(rows, columns, middle) * f[rows, columns] < 0
    rows, columns, middle = rows[there], columns[there], middle[there]
    up = f[rows, columns] < 0
    before = rows, columns, s[rows], middle, up
    after = rows, columns, middle, s[rows + 1], ~up
    return tuple(np.concatenate(parts) for parts in zip(single, before, after, strict=True))


def _part(sample: Sample, rows: Any) -> Sample:
    return Sample(sample.s[rows], [array[rows] for array in sample.y])


def _joined(first: Sample, second: Sample) -> Sample:
    y = [np.concatenate(pair) for pair in zip(first.y, second.y, strict=True)]
    return Sample(np.concatenate([first.s, second.s]), y)


def _filled(places: Floats, widest: Floats) -> Floats:
    """Return the places with further ones between, no step wider than asked for."""
    steps = np.diff(places)
    counts = np.maximum(np.ceil(steps / widest - 1e-9), 1).astype(int)
    if np.all(counts == 1):
        return places
    inner = [
        place + step * np.arange(count) / count
        for place, step, count in zip(places[:-1], steps, counts, strict=True)
    ]
    return np.concatenate([*inner, places[-1:]])
