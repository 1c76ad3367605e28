"""All solutions of friction at a pose: none, one or several.

A group's sizes m solve m_j = size_j(L + S m). Guides, slots and meshes are piecewise linear:
every choice of pieces gives linear equations, and all choices are tried, so that their count
is proved. Pins are lengths of vectors: one pin leaves a quadratic equation, several are
solved by Newton's method, their count is proved where the map contracts and otherwise that
of the solutions found, as in groups with ball joints. Groups are solved one after another from
the last one, each solution leads to those of the groups before it.

The solution that continues the one without friction is followed by growing all coefficients
of friction from zero; where it ends is the critical factor.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mechdae.kernels.graphs.kinetostatics import Balance
from mechdae.kernels.run.batch import Batch
from mechdae.model.forces.feedback import ACROSS
from mechdae.records import dataclass

CHOICES = 4096
"""Choices of pieces that are tried in one group."""
SAME = 1e-6
"""Share of the sizes within which two solutions are the same one: near the end of a branch
they are known to half of the digits."""
SLACK = 1e-9
"""Share by which the chosen piece may be smaller than another one."""
STARTS = 64
"""Starts of Newton's method where several pins act on each other."""
STEPS = 16
FINEST, ROUGH = 1e-10, 1e-6
"""Shares to which critical factors are found: of poses that jam, of margins."""
FIRST = 1 / 16


@dataclass
class FrictionSolutions:
    """Solutions at one pose: sizes (k, feedbacks), which continues from no friction.

    ``connected`` is its place or None; ``critical`` the factor on all coefficients of friction
    at which it ends, None where it was not looked for or does not end; ``joint`` is the one
    whose friction ends it.
    """

    sizes: Any
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
    start: list[Any]
    slope: list[Any]

    def forms(self, sizes: Any) -> list[Any]:
        """Return the forms (n, rows) of each for sizes (n, feedbacks)."""
        return _forms(self.start, self.slope, sizes[:, self.places])

    def slopes(self, sizes: Any) -> Any:
        """Return d size / d m, (n, k, k), at sizes (n, feedbacks)."""
        return _slopes(self.laws, self.start, self.slope, sizes[:, self.places])


class Branches:
    """Solutions of a balance at single poses.

    Parameters
    ----------
    balance
        The forces in symbols.
    p
        Values of the parameters.
    stages
        `Balance.stages` for many poses.
    """

    def __init__(self, balance: Balance, p: Any, stages: Batch) -> None:
        self.balance, self.p, self._stages = balance, p, stages
        self.groups: list[tuple[list[int], list[slice], list[str]]] = []
        for share in balance.shares:
            if share.feedbacks:
                laws = [balance.feedbacks[k].law for k in share.feedbacks]
                self.groups.append((share.feedbacks, share.forms, laws))

    def at(self, inputs: Sequence[Any], critical: bool = True) -> FrictionSolutions:
        """Return the solutions at one pose; inputs are those of the balance, one row each.

        Without solutions the critical factor is looked for only if asked.
        """
        solutions, proven = self._all(inputs)
        connected = 0 if len(solutions) == 1 and proven else None
        reached: float | None = None
        joint = ""
        if connected is None and (solutions or critical or not proven):
            reached, last, joint = self.continued(inputs)
            if last is not None:
                reached = None
                apart = [_apart(own, last) for own in solutions]
                if not apart or min(apart) > SAME:
                    solutions.append(last)
                    apart.append(0.0)
                connected = int(np.argmin(apart))
        sizes = np.array(solutions).reshape(len(solutions), len(self.balance.feedbacks))
        return FrictionSolutions(sizes, proven, connected, reached, joint)

    # -- all solutions -----------------------------------------------------------------------

    def _all(self, inputs: Sequence[Any]) -> tuple[list[Any], bool]:
        proven = True
        fronts = [np.zeros(len(self.balance.feedbacks))]
        for g, (places, _, _) in enumerate(self.groups):
            following = []
            for sizes in fronts:
                start, slope = self._group(inputs, sizes, g)
                own, sure = solutions_of(self.groups[g][2], start, slope)
                proven &= sure
                for m in own:
                    whole = sizes.copy()
                    whole[places] = m
                    following.append(whole)
            fronts = following
        return fronts, proven

    def staged(self, inputs: Sequence[Any], sizes: Any) -> Iterator[Stage]:
        """Yield the linear forms of each group at poses, given the sizes of the others."""
        starts, slopes = self._stages(*inputs, sizes)
        first, second = 0, 0
        for places, forms, laws in self.groups:
            rows, k = sum(s.stop - s.start for s in forms), len(places)
            start = starts[:, first : first + rows]
            slope = slopes[:, second : second + rows * k].reshape(-1, k, rows).transpose(0, 2, 1)
            yield Stage(places, laws, [start[:, s] for s in forms], [slope[:, s] for s in forms])
            first, second = first + rows, second + rows * k

    def _group(self, inputs: Sequence[Any], sizes: Any, g: int) -> tuple[list[Any], list[Any]]:
        """Return forms without own sizes, and their slopes: [j] (k,), [j] (k, own)."""
        stage = next(itertools.islice(self.staged(inputs, sizes[None, :]), g, None))
        return [own[0] for own in stage.start], [own[0] for own in stage.slope]

    # -- the one that continues from no friction -----------------------------------------------

    def continued(self, inputs: Sequence[Any]) -> tuple[float, Any, str]:
        """Return the largest factor reached on friction (at most 1), and the sizes at 1.

        Where it is not reached, None and the joint whose friction feeds itself most.
        """
        return self._grown(inputs, 1.0, FINEST)

    def limit(self, inputs: Sequence[Any], most: float) -> tuple[float | None, str]:
        """Return the factor on friction at which the solution ends, None above `most`."""
        reached, last, joint = self._grown(inputs, most, ROUGH)
        return (reached, joint) if last is None else (None, "")

    def _grown(self, inputs: Sequence[Any], to: float, finest: float) -> tuple[float, Any, str]:
        reached, step = 0.0, FIRST
        sizes = self._follow(inputs, 0.0, np.zeros(len(self.balance.feedbacks)))
        if sizes is None:
            return 0.0, None, ""
        while reached < to:
            ahead = min(to, reached + step)
            after = self._follow(inputs, ahead, sizes)
            if after is None:
                step = (ahead - reached) / 2
                if step < finest * max(1.0, reached):
                    return reached, None, self._culprit(inputs, reached, sizes)
            else:
                step = 2 * (ahead - reached)
                reached, sizes = ahead, after
        return to, sizes, ""

    def _culprit(self, inputs: Sequence[Any], factor: float, sizes: Any) -> str:
        """Return the joint whose friction takes the largest part in what makes the sizes grow.

        With G the slopes of the sizes and x, y the right and left vectors of its eigenvalue 1
        y_j x_j / y x is the share by which that eigenvalue grows with the friction of joint j.
        """
        scaled = [*inputs[:-1], np.array([factor])]
        worst, joint = np.inf, ""
        for g, (places, _, laws) in enumerate(self.groups):
            start, slope = self._group(scaled, sizes, g)
            gradient = _slopes(laws, start, slope, sizes[places])
            values, vectors = np.linalg.eig(gradient)
            nearest = int(np.argmin(np.abs(values - 1)))
            if abs(values[nearest] - 1) < worst:
                worst = float(abs(values[nearest] - 1))
                left = np.linalg.pinv(vectors)[nearest]
                shares = np.abs(left * vectors[:, nearest])
                joint = self.balance.feedbacks[places[int(np.argmax(shares))]].joint
        return joint

    def _follow(self, inputs: Sequence[Any], factor: float, sizes: Any) -> Any:
        """Return the sizes for a factor on friction near known ones, None where they end."""
        scaled = [*inputs[:-1], np.array([factor])]
        whole = sizes.copy()
        for g, (places, _, laws) in enumerate(self.groups):
            start, slope = self._group(scaled, whole, g)
            m = _newton(laws, start, slope, whole[places])
            if m is None:
                return None
            gradient = _slopes(laws, start, slope, m)
            if np.linalg.det(np.eye(len(m)) - gradient) <= 0 or (m[_sized(laws)] < 0).any():
                return None
            whole[places] = m
        return whole


def _apart(a: Any, b: Any) -> float:
    size = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0), 1e-300)
    return float(np.abs(a - b).max(initial=0.0) / size)


def sizes_of(laws: Sequence[str], forms: Sequence[Any]) -> Any:
    """Return the sizes (..., k) for the values of their forms, (..., rows) each."""
    every = [_size(law, form) for law, form in zip(laws, forms, strict=True)]
    return np.stack(every, axis=-1) if every else np.zeros(0)


def _size(law: str, form: Any) -> Any:
    if law == "length":
        return np.sqrt(np.sum(form * form, axis=-1))
    if law in ACROSS:
        return form[..., 0] * form[..., 1 + ACROSS.index(law)] / _least(form)
    return form.max(axis=-1)


def _least(form: Any) -> Any:
    """Return |t| of the forms (p, t), not below what may be divided by."""
    return np.fmax(np.sqrt(np.sum(form[..., 1:] ** 2, axis=-1)), 1e-150)


def _sized(laws: Sequence[str]) -> list[int]:
    """Return the places of sizes that are never negative."""
    return [j for j, law in enumerate(laws) if law not in ACROSS]


def _forms(start: Sequence[Any], slope: Sequence[Any], m: Any) -> list[Any]:
    pairs = zip(start, slope, strict=True)
    return [first + (own @ m[..., None])[..., 0] for first, own in pairs]


def _slopes(laws: Sequence[str], start: Sequence[Any], slope: Sequence[Any], m: Any) -> Any:
    """Return d size / d m, (..., k, k)."""
    rows = []
    for law, form, own in zip(laws, _forms(start, slope, m), slope, strict=True):
        if law == "length":
            length = np.fmax(np.sqrt(np.sum(form * form, axis=-1)), 1e-300)
            rows.append((form[..., None, :] @ own)[..., 0, :] / length[..., None])
        elif law in ACROSS:
            size, k = _least(form)[..., None], ACROSS.index(law)
            p, t = form[..., :1], form[..., 1:]
            turned = (t[..., None, :] @ own[..., 1:, :])[..., 0, :] * t[..., k : k + 1] / size**2
            moved = own[..., 0, :] * t[..., k : k + 1] + p * (own[..., 1 + k, :] - turned)
            rows.append(moved / size)
        else:
            most = np.argmax(form, axis=-1)[..., None, None]
            own = np.broadcast_to(own, (*form.shape[:-1], *own.shape[-2:]))
            rows.append(np.take_along_axis(own, most, axis=-2)[..., 0, :])
    return np.stack(rows, axis=-2)


def _newton(laws: Sequence[str], start: Sequence[Any], slope: Sequence[Any], m: Any) -> Any:
    """Return sizes that solve their laws, from a start near them; None without success."""
    for _ in range(STEPS):
        left = m - sizes_of(laws, _forms(start, slope, m))
        size = max(np.abs(m).max(initial=0.0), 1e-300)
        if not np.isfinite(left).all():
            return None
        if np.abs(left).max(initial=0.0) <= 4e-15 * size:
            return m
        try:
            step = np.linalg.solve(np.eye(len(m)) - _slopes(laws, start, slope, m), left)
        except np.linalg.LinAlgError:
            return None
        m = m - step
        if np.abs(step).max(initial=0.0) <= 2e-16 * size:
            break
    left = m - sizes_of(laws, _forms(start, slope, m))
    size = max(np.abs(m).max(initial=0.0), 1e-300)
    return m if np.abs(left).max(initial=0.0) <= 1e-11 * size else None


def _newton_from(
    laws: Sequence[str], start: Sequence[Any], slope: Sequence[Any], starts: Any
) -> list[Any]:
    """Return what `_newton` finds from each of many starts (n, k), without those that fail."""
    m, going = starts.copy(), np.arange(len(starts))
    ended = np.zeros(len(starts), bool)
    for _ in range(STEPS):
        own = m[going]
        left = own - sizes_of(laws, _forms(start, slope, own))
        size = np.fmax(np.abs(own).max(axis=1, initial=0.0), 1e-300)
        finite = np.isfinite(left).all(axis=1)
        there = finite & (np.abs(left).max(axis=1, initial=0.0) <= 4e-15 * size)
        ended[going[there]] = True
        further = finite & ~there
        own, left, size, going = (part[further] for part in (own, left, size, going))
        if not len(going):
            break
        matrix = np.eye(m.shape[1]) - _slopes(laws, start, slope, own)
        step, solved = _solved(matrix, left)
        m[going] = own - step
        small = solved & (np.abs(step).max(axis=1, initial=0.0) <= 2e-16 * size)
        ended[going[small]] = True
        going = going[solved & ~small]
    ended[going] = True
    m = m[ended]
    left = m - sizes_of(laws, _forms(start, slope, m))
    size = np.fmax(np.abs(m).max(axis=1, initial=0.0), 1e-300)
    return list(m[np.abs(left).max(axis=1, initial=0.0) <= 1e-11 * size])


def _solved(matrix: Any, right: Any) -> tuple[Any, Any]:
    """Return the solutions (n, k) of systems, zeros where one is singular, and which are not."""
    try:
        return np.linalg.solve(matrix, right[..., None])[..., 0], np.ones(len(right), bool)
    except np.linalg.LinAlgError:
        found, regular = np.zeros_like(right), np.ones(len(right), bool)
    for k in range(len(right)):
        try:
            found[k] = np.linalg.solve(matrix[k], right[k])
        except np.linalg.LinAlgError:
            regular[k] = False
    return found, regular


def solutions_of(
    laws: Sequence[str], start: Sequence[Any], slope: Sequence[Any]
) -> tuple[list[Any], bool]:
    """Return all sizes that fit their laws, and whether their count is proved.

    Parameters
    ----------
    laws
        "length" or "largest", of each size.
    start, slope
        Linear forms (k,) of each size where all are zero, and their slopes (k, sizes).
    """
    if any(law in ACROSS for law in laws):
        return _with_balls(laws, start, slope), False
    flat = [j for j, law in enumerate(laws) if law == "largest"]
    pins = [j for j, law in enumerate(laws) if law == "length"]
    counts = [len(start[j]) for j in flat]
    proven = True
    if np.prod(counts, initial=1.0) > CHOICES:
        m = _newton(laws, start, slope, sizes_of(laws, start))
        return ([] if m is None else [m]), False
    found: list[Any] = []
    for choice in itertools.product(*[range(count) for count in counts]):
        own, sure = _chosen(laws, start, slope, flat, pins, choice)
        proven &= sure
        for m in own:
            if _holds(start, slope, flat, pins, choice, m) and all(
                _apart(m, other) > SAME for other in found
            ):
                found.append(m)
    return found, proven


def _with_balls(laws: Sequence[str], start: Sequence[Any], slope: Sequence[Any]) -> list[Any]:
    """Return the solutions found of a group with ball joints: friction turns with the load."""
    first = sizes_of(laws, start)
    rng, size = np.random.default_rng(0), max(float(np.abs(first).max(initial=0.0)), 1e-300)
    starts = size * 10.0 ** rng.uniform(-1, 3, (STARTS, len(laws)))
    starts *= np.where([law in ACROSS for law in laws], rng.uniform(-1, 1, starts.shape), 1.0)
    starts[0] = first
    found: list[Any] = []
    for m in _newton_from(laws, start, slope, starts):
        sized = m[_sized(laws)]
        known = any(_apart(m, other) <= SAME for other in found)
        if not known and (sized >= -SLACK * np.abs(m).max(initial=0.0)).all():
            found.append(m)
    return found


def _holds(
    start: Sequence[Any], slope: Sequence[Any], flat: list[int], pins: Any, choice: Any, m: Any
) -> bool:
    """Return whether the chosen pieces are the largest ones, and no length is negative."""
    if not np.isfinite(m).all():
        return False
    slack = SLACK * max(float(np.abs(m).max(initial=0.0)), 0.0)
    for j, k in zip(flat, choice, strict=True):
        form = start[j] + slope[j] @ m
        if form[k] < form.max() - slack:
            return False
    return bool((m[pins] >= -slack).all())


def _chosen(
    laws: Sequence[str],
    start: Sequence[Any],
    slope: Sequence[Any],
    flat: list[int],
    pins: list[int],
    choice: Any,
) -> tuple[list[Any], bool]:
    """Return the solutions for one choice of pieces; pieces are not checked."""
    count = len(laws)
    a = np.array([start[j][k] for j, k in zip(flat, choice, strict=True)])
    A = np.array([slope[j][k] for j, k in zip(flat, choice, strict=True)]).reshape(-1, count)
    matrix = np.eye(len(flat)) - A[:, flat]
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return [], False
    first, onto = inverse @ a, inverse @ A[:, pins]  # m_flat = first + onto m_pins

    def whole(m_pins: Any) -> Any:
        m = np.zeros(count)
        m[pins] = m_pins
        m[flat] = first + onto @ m_pins
        return m

    if not pins:
        return [whole(np.zeros(0))], True
    vectors = [start[j] + slope[j][:, flat] @ first for j in pins]
    turns = [slope[j][:, pins] + slope[j][:, flat] @ onto for j in pins]
    if len(pins) == 1:
        return [whole(np.array([m])) for m in _one_pin(vectors[0], turns[0][:, 0])], True
    lengths = ["length"] * len(pins)
    K = np.array([np.sqrt(np.sum(turn * turn, axis=0)) for turn in turns])
    weights = 1 + K.sum(axis=1)
    first_guess = sizes_of(lengths, vectors)
    if np.max((K @ weights) / weights) < 1:
        m = _newton(lengths, vectors, turns, first_guess)
        return ([] if m is None else [whole(m)]), m is not None
    scales = 10.0 ** np.random.default_rng(0).uniform(-1, 3, (STARTS, len(pins)))
    starts = max(first_guess.max(), 1e-300) * scales
    starts[0] = first_guess
    found: list[Any] = []
    for m in _newton_from(lengths, vectors, turns, starts):
        if (m >= 0).all() and all(_apart(m, o) > SAME for o in found):
            found.append(m)
    return [whole(m) for m in found], False


def _one_pin(vector: Any, turn: Any) -> list[float]:
    """Return the m >= 0 with m = |vector + turn m|."""
    a = 1 - float(turn @ turn)
    b, c = float(vector @ turn), float(vector @ vector)
    # a m^2 - 2 b m - c = 0
    if c == 0:
        return [0.0]
    if abs(a) < 1e-14:
        return [-c / (2 * b)] if b < 0 else []
    root = b * b + a * c
    if root < 0:
        return []
    far = b + np.copysign(np.sqrt(root), b)
    roots = [far / a, -c / far] if far else [0.0]
    return sorted({float(m) for m in roots if m >= 0})
