"""Places of all points of a scheme over a turn in closed form, and their exact derivatives.

Batches: many sets of dimensions of one scheme at once. A set is the places (n,) of the points in
one pose, as complex numbers; lengths and assembly modes follow from it. Nothing is certified here.

Dyads with a sliding pair in closed form: places, sines of transmission, exact derivatives.

A guide is the straight line through a point of its link and the middle of the dyad in the pose
that a scheme is described by; it turns with the link.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.parts.types.schemes.scheme import CRANK, DYAD, FIXED, RIGID, SLIDER, Scheme
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Integers, Matrices


@dataclass
class Moved:
    """A batch of arrays by point: places in the first pose and at angles, and derivatives.

    ``start``, ``x`` (n, b, 1) and (n, b, t) complex. ``rates``, ``found``: derivatives of places in
    the first pose (n, p), and of those at angles (b, t, p) each.
    """

    start: Complexes
    x: Complexes
    rates: Any = None
    found: Any = None

    def at(self, rows: Integers, places: Integers) -> Moved:
        """Return one angle of each set."""
        picked = {
            k: np.broadcast_to(d, (*self.x.shape[1:], d.shape[-1]))[rows, places][:, None]
            for k, d in enumerate(self.found)
        }
        return Moved(self.start, self.x[:, rows, places][:, :, None], self.rates, picked)


def turning(scheme: Scheme, moved: Moved, g: int) -> Any:
    """Return by what a link with a guide has turned (b, t), complex of size one."""
    kind, i, j = scheme.points[g]
    if kind == FIXED:
        return np.ones((1, 1), complex)
    i, j = (0, g) if kind == CRANK else (i, j)
    return (moved.x[j] - moved.x[i]) / (moved.start[j] - moved.start[i])


def _turning_rate(scheme: Scheme, moved: Moved, g: int, turn: Complexes) -> Any:
    kind, i, j = scheme.points[g]
    if kind == FIXED:
        return np.zeros((1, 1, moved.rates.shape[1]), complex)
    i, j = (0, g) if kind == CRANK else (i, j)
    span = (moved.start[j] - moved.start[i])[:, :, None]
    gap = moved.rates[j] - moved.rates[i]
    return (moved.found[j] - moved.found[i] - turn[:, :, None] * gap) / span


def slid(scheme: Scheme, moved: Moved, k: int) -> tuple[Complexes, Floats]:
    """Return the places of the middle of a dyad with a sliding pair, and the sines (b, t)."""
    kind, i, j = scheme.points[k]
    start, x = moved.start, moved.x
    if kind == SLIDER:
        way = start[k] - start[j]
        way = way / np.abs(way) * turning(scheme, moved, j)
        first = start[k] - start[i]
        length = np.abs(first)
        side = np.sign((np.conj(first) * (start[k] - start[j])).real)
        off = (x[j] - x[i]) * np.conj(way)
        along = side * np.sqrt(length**2 - off.imag**2)
        return x[j] + (along - off.real) * way, np.abs(along) / length
    way = start[j] - start[k]
    way = way / np.abs(way)
    off = (start[j] - start[i]) * np.conj(way)
    gap = x[j] - x[i]
    far = np.abs(gap)
    along = np.sign(off.real) * np.sqrt(far**2 - off.imag**2)
    turn = gap / ((along + 1j * off.imag) * way)
    return x[i] + (start[k] - start[i]) * turn, np.abs(along) / far


def slid_derivatives(scheme: Scheme, moved: Moved, k: int) -> Any:
    """Return the derivatives (b, t, p) of the middle by implicit differentiation."""
    kind, i, j = scheme.points[k]
    start, x, rates, found = moved.start, moved.x, moved.rates, moved.found
    if kind == SLIDER:
        turn = turning(scheme, moved, j)
        way = (start[k] - start[j]) * turn
        share = ((x[k] - x[j]) / way).real[:, :, None]
        e = x[k] - x[i]
        first = start[k] - start[i]
        longer = (np.conj(first)[:, :, None] * (rates[k] - rates[i])).real
        moving = found[j] + share * _way_rate(scheme, moved, k, turn)
        rest = longer - (np.conj(e)[:, :, None] * (moving - found[i])).real
        return moving + way[:, :, None] * (rest / (np.conj(e) * way).real[:, :, None])
    turn, rate = _rod(moved, i, j, k)
    arm = start[k] - start[i]
    turned = (rates[k] - rates[i]) * turn[:, :, None]
    return found[i] + turned + (1j * arm * turn)[:, :, None] * rate


def _way_rate(scheme: Scheme, moved: Moved, k: int, turn: Complexes) -> Any:
    """Return the derivatives of the direction of a guide, as long as it was drawn."""
    _, _, j = scheme.points[k]
    start, rates = moved.start, moved.rates
    spin = _turning_rate(scheme, moved, j, turn)
    return (rates[k] - rates[j]) * turn[:, :, None] + (start[k] - start[j])[:, :, None] * spin


def _rod(moved: Moved, i: int, j: int, k: int) -> tuple[Complexes, Matrices]:
    """Return by what a rod has turned (b, t), and the derivatives (b, t, p) of that angle."""
    start, x, rates, found = moved.start, moved.x, moved.rates, moved.found
    turn = (x[k] - x[i]) / (start[k] - start[i])
    way, gap = start[j] - start[k], x[j] - x[i]
    slot = way * turn
    swung = rates[j] - rates[k]
    before = ((rates[j] - rates[i]) * np.conj(way)[:, :, None]).imag + (
        (start[j] - start[i])[:, :, None] * np.conj(swung)
    ).imag
    now = ((found[j] - found[i]) * np.conj(slot)[:, :, None]).imag + (
        gap[:, :, None] * np.conj(swung * turn[:, :, None])
    ).imag
    return turn, (now - before) / (gap * np.conj(slot)).real[:, :, None]


def sine_rate(scheme: Scheme, moved: Moved, k: int, rate: Complexes) -> Any:
    """Return the derivatives (b, t, p) of the sine of a dyad with a sliding pair."""
    kind, i, j = scheme.points[k]
    start, x, rates, found = moved.start, moved.x, moved.rates, moved.found
    if kind == SLIDER:
        turn = turning(scheme, moved, j)
        one, done = x[k] - x[i], rate - found[i]
        other, dother = (start[k] - start[j]) * turn, _way_rate(scheme, moved, k, turn)
    else:
        turn, angle = _rod(moved, i, j, k)
        one, done = x[j] - x[i], found[j] - found[i]
        other = (start[j] - start[k]) * turn
        dother = (rates[j] - rates[k]) * turn[:, :, None] + 1j * other[:, :, None] * angle
    cosine = (np.conj(one) * other).real
    sizes = np.abs(one) * np.abs(other)
    one, other = one[:, :, None], other[:, :, None]
    change = (np.conj(done) * other + np.conj(one) * dother).real
    shares = (np.conj(one) * done).real / np.abs(one) ** 2
    shares = shares + (np.conj(other) * dother).real / np.abs(other) ** 2
    found_rate = (change - cosine[:, :, None] * shares) / sizes[:, :, None]
    return np.sign(cosine)[:, :, None] * found_rate


@dataclass
class SchemeTurn:
    """What a batch does over a turn of the crank.

    ``x`` (n, b, t): places of the points. ``sines``: of each dyad (b, t): sine of the angle between
    its bars, of the transmission angle where it has a slide; nan where it does not assemble.
    ``derivatives`` (b, t, p): of the tracing point by x and y of all points but the first one; if
    asked for. ``every``: the same of each point. ``reaches``: of each way of a guide: the longest
    (b,), and its derivatives (b, p). ``slopes``: of each dyad: place (b,) of its least sine, and
    the derivatives (b, p) of it there.
    """

    x: Complexes
    sines: dict[int, Floats]
    derivatives: Any = None
    slopes: dict[int, tuple[Any, Any]] | None = None
    every: list[Complexes] | None = None
    reaches: list[tuple[Floats, Floats]] | None = None

    @property
    def least(self) -> Floats:
        """(b,) the least sine of all dyads; negative where one does not assemble."""
        every = [np.nan_to_num(sines, nan=-1.0).min(axis=1) for sines in self.sines.values()]
        return np.min(every, axis=0) if every else np.ones(self.x.shape[1])


def turned(
    scheme: Scheme,
    places: Complexes,
    angles: Floats,
    derivatives: bool = False,
    by_angle: bool = False,
    dimensions: bool = True,
) -> SchemeTurn:
    """Return a batch at crank angles, counted from the pose that the places are those of.

    `places` (b, n) complex. `angles` (t,), or (b, t) where each set has its own [rad].
    """
    start = np.ascontiguousarray(np.asarray(places, complex).T)[:, :, None]
    n, count = scheme.size, start.shape[1]
    crank = np.exp(1j * np.atleast_2d(angles))
    x = np.empty((n, count, crank.shape[1]), complex)
    sines: dict[int, Floats] = {}
    with np.errstate(invalid="ignore", divide="ignore"):
        for k, (kind, i, j) in enumerate(scheme.points):
            if kind == FIXED:
                x[k] = start[k]
            elif kind == CRANK:
                x[k] = start[0] + (start[k] - start[0]) * crank
            elif kind == RIGID:
                x[k] = x[i] + (start[k] - start[i]) / (start[j] - start[i]) * (x[j] - x[i])
            elif kind == DYAD:
                x[k], sines[k] = _dyad(x[i], x[j], start[k] - start[i], start[k] - start[j])
            else:
                x[k], sines[k] = slid(scheme, Moved(start, x), k)
        turn = SchemeTurn(x, sines)
        if derivatives:
            _differentiate(scheme, start, turn, by_angle, dimensions)
    return turn


def _dyad(
    one: Complexes, other: Complexes, first: Complexes, second: Complexes
) -> tuple[Complexes, Floats]:
    """Return where two bars meet, on the side where they met at the start, and the sine there."""
    gap = other - one
    far = gap.real**2 + gap.imag**2
    a, b = first.real**2 + first.imag**2, second.real**2 + second.imag**2
    along = (a - b + far) / (2 * far)
    side = np.sign((first * np.conj(first - second)).imag)
    across = np.sqrt(a / far - along**2)
    return one + gap * (along + 1j * side * across), across * far / np.sqrt(a * b)


def _differentiate(
    scheme: Scheme, start: Complexes, turn: SchemeTurn, by_angle: bool, dimensions: bool
) -> None:
    """Add derivatives by implicit differentiation of the lengths of bars."""
    x, size = turn.x, 2 * (scheme.size - 1) * dimensions + by_angle
    count, steps = x.shape[1:]
    found: list[Complexes] = []
    turn.slopes = {}
    units = np.zeros((scheme.size, size), complex)
    for k in range(1, scheme.size if dimensions else 1):
        units[k, 2 * k - 2], units[k, 2 * k - 1] = 1.0, 1j
    for k, (kind, i, j) in enumerate(scheme.points):
        if kind == FIXED:
            found.append(np.broadcast_to(units[k], (count, steps, size)))
        elif kind == CRANK:
            crank = (x[k] - x[0]) / (start[k] - start[0])
            moved = crank[:, :, None] * (units[k] - units[0]) + units[0]
            if by_angle:
                moved[:, :, -1] = 1j * (x[k] - x[0])
            found.append(moved)
        elif kind == RIGID:
            span = start[j] - start[i]
            share = (start[k] - start[i]) / span
            turning = ((units[k] - units[i]) - share * (units[j] - units[i])) / span
            moved = found[i] + share[:, :, None] * (found[j] - found[i])
            found.append(moved + (x[j] - x[i])[:, :, None] * turning[:, None, :])
        elif kind == DYAD:
            found.append(_dyad_derivatives(scheme, start, turn, found, units, k))
        else:
            found.append(_slid_derivatives(scheme, start, turn, found, units, k))
    turn.derivatives, turn.every = found[scheme.trace], found
    turn.reaches = [_reach(x, found, *way) for way in scheme.ways]


def _slid_derivatives(
    scheme: Scheme, start: Complexes, turn: SchemeTurn, found: list[Complexes], units: Complexes,
    k: int,
) -> Any:  # fmt: skip
    """Return the derivatives of the middle of a dyad with a slide; enter that of its sine."""
    moved = Moved(start, turn.x, units, found)
    rate = slid_derivatives(scheme, moved, k)
    at = np.nan_to_num(turn.sines[k], nan=-1.0).argmin(axis=1)
    rows = np.arange(len(at))
    assert turn.slopes is not None
    slope = sine_rate(scheme, moved.at(rows, at), k, rate[rows, at][:, None])
    turn.slopes[k] = at, slope[:, 0]
    return rate


def _reach(x: Complexes, found: list[Complexes], i: int, j: int) -> tuple[Floats, Floats]:
    """Return the longest distance of two points, and its derivatives."""
    gap = x[j] - x[i]
    at = np.nan_to_num(np.abs(gap), nan=-1.0).argmax(axis=1)
    rows = np.arange(len(at))
    shape = (*x.shape[1:], found[j].shape[-1])
    one, other = (np.broadcast_to(found[k], shape)[rows, at] for k in (i, j))
    far = np.abs(gap[rows, at])
    return far, (np.conj(gap[rows, at])[:, None] * (other - one)).real / far[:, None]


def _dyad_derivatives(
    scheme: Scheme, start: Complexes, turn: SchemeTurn, found: list[Complexes], units: Complexes,
    k: int,
) -> Any:  # fmt: skip
    """Return the derivatives of a dyad's pin; enter the slope of its least sine."""
    _, i, j = scheme.points[k]
    x = turn.x
    e, f = x[k] - x[i], x[k] - x[j]
    first, second = start[k] - start[i], start[k] - start[j]
    a = (np.conj(first) * (units[k] - units[i])).real[:, None, :]
    b = (np.conj(second) * (units[k] - units[j])).real[:, None, :]
    cross = (np.conj(e) * f).imag[:, :, None]
    along = a + (np.conj(e)[:, :, None] * found[i]).real
    across = b + (np.conj(f)[:, :, None] * found[j]).real
    moved = 1j * (across * e[:, :, None] - along * f[:, :, None]) / cross
    at = np.nan_to_num(turn.sines[k], nan=-1.0).argmin(axis=1)
    rows = np.arange(len(at))
    e, f, cross = e[rows, at][:, None], f[rows, at][:, None], cross[rows, at]
    de, df = (moved[rows, at] - found[m][rows, at] for m in (i, j))
    lengths = np.abs(first * second)
    rate = (np.conj(de) * f + np.conj(e) * df).imag / lengths
    shares = a[:, 0] / np.abs(first) ** 2 + b[:, 0] / np.abs(second) ** 2
    assert turn.slopes is not None
    turn.slopes[k] = at, np.sign(cross) * (rate - cross / lengths * shares)
    return moved


def shortest(scheme: Scheme, places: Complexes) -> Any:
    """Return the length of the shortest of crank and bars of dyads (b,)."""
    places = np.asarray(places, complex)
    one, other = np.array(scheme.members).T
    return np.abs(places[:, other] - places[:, one]).min(axis=1)


def material(
    scheme: Scheme, places: Complexes, slopes: bool = False, turn: SchemeTurn | None = None
) -> Any:
    """Return twice the sum of the lengths of bars (b,), and its derivatives (b, p) if asked for."""
    places = np.asarray(places, complex)
    one, other = np.array(scheme.bars).T
    gaps = places[:, other] - places[:, one]
    lengths = np.abs(gaps)
    total = 2 * lengths.sum(axis=1)
    if scheme.ways:
        assert turn is not None
        for i, j in scheme.ways:
            total = total + 2 * np.nan_to_num(np.abs(turn.x[j] - turn.x[i])).max(axis=1)
    if not slopes:
        return total
    with np.errstate(invalid="ignore", divide="ignore"):
        ways = np.where(lengths > 0, gaps / lengths, 0.0)
    pull = np.zeros(places.shape, complex)
    for k, (i, j) in enumerate(scheme.bars):
        pull[:, j] += 2 * ways[:, k]
        pull[:, i] -= 2 * ways[:, k]
    pull = pull[:, 1:]
    found = np.stack([pull.real, pull.imag], axis=2).reshape(len(places), -1)
    if scheme.ways:
        assert turn is not None
        assert turn.reaches is not None
        for _, slope in turn.reaches:
            found = found + 2 * np.nan_to_num(slope[:, : found.shape[1]])
    return total, found
