"""Article 004 on the page of articles: equations and claims of a geared five-bar."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from article_text import (
    below,
    fixed,
    percent,
    places,
    sign,
    table,
    text,
)

import mechdae as md

FIVE = "geared-five-bar"

EXAMPLE = (0.1, 0.048, 0.09, 0.08)
SETS: dict[str, tuple[float, ...]] = {
    "the article's example": EXAMPLE,
    "double crank": (0.04, 0.09, 0.08, 0.1),
    "short coupler": (0.1, 0.09, 0.03, 0.08),
    "shortest l3": (0.1, 0.09, 0.08, 0.04),
    "non-Grashof": (0.11, 0.06, 0.05, 0.08),
}
RATIOS = [
    Fraction(p, q)
    for p, q in (
        (-1, 1), (-2, 1), (-1, 2), (2, 1), (1, 2), (3, 1), (1, 3), (-3, 1), (-1, 3), (3, 2), (2, 3)
    )
]  # fmt: skip
"""i24 as in the article's equation (12)."""
PRINTED_SWING = "1.344"


@cache
def five() -> Any:
    return md.load(FIVE)


def changes(lengths: tuple[float, ...], i42: Fraction) -> dict[str, Any]:
    return dict(zip(("l0", "l1", "l2", "l3"), lengths, strict=True)) | {"i42": str(i42)}


@cache
def wheel_modes(lengths: tuple[float, ...], i42: Fraction, phi4: float) -> Any:
    task = md.Modes(driver=md.Driver(coordinate="wheel.angle", at=(phi4,)))
    return md.solve(five(), task, set=changes(lengths, i42))


@cache
def wheel_window(
    lengths: tuple[float, ...], i42: Fraction, mode: str | None = None, poses: int = 361
) -> Any:
    driver = md.Driver(coordinate="wheel.angle", range="assembled", speed=1.0)
    task = md.Sweep(driver=driver, poses=poses)
    return md.solve(five(), task, set=changes(lengths, i42), mode=mode)


def coupler_rate(lengths: tuple[float, ...], phi1: Any, side: int) -> tuple[Any, Any]:
    """Return φ2 and dφ2/dφ1 of the four-bar in closed form; `side` is the assembly."""
    l0, l1, l2, l3 = lengths
    d = l0 + l1 * np.exp(1j * phi1)
    phi2 = np.angle(d) + side * np.arccos((np.abs(d) ** 2 + l2**2 - l3**2) / (2 * np.abs(d) * l2))
    phi3 = np.angle(d - l2 * np.exp(1j * phi2))
    return phi2, l1 * np.sin(phi1 - phi3) / (l2 * np.sin(phi2 - phi3))


def refined(function: Callable[[float], float], a: float, b: float) -> float:
    """Return the root of a function between two arguments with different signs."""
    fa = function(a)
    for _ in range(200):
        m = 0.5 * (a + b)
        fm = function(m)
        if (fm > 0) == (fa > 0):
            a, fa = m, fm
        else:
            b = m
    return 0.5 * (a + b)


def roots(function: Callable[[Any], Any], count: int = 3600) -> list[float]:
    """Return the roots of a function of an angle over one turn."""
    grid = np.linspace(-np.pi, np.pi, count + 1)
    values = function(grid)
    return [
        refined(function, float(grid[k]), float(grid[k + 1]))
        for k in np.flatnonzero(values[:-1] * values[1:] < 0)
    ]


def rate_range(lengths: tuple[float, ...]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return least and largest dφ2/dφ1 of the + assembly, each with its φ1."""

    def slope(phi1: Any, h: float = 1e-4) -> Any:
        ahead, back = (coupler_rate(lengths, phi1 + s * h, 1)[1] for s in (1, -1))
        return (ahead - back) / (2 * h)

    found = [(float(coupler_rate(lengths, a, 1)[1]), a) for a in roots(slope)]
    return min(found), max(found)


def real_roots(lengths: tuple[float, ...], i24: Fraction, phi4: Any) -> Any:
    """Return the number of real roots of (12) at every wheel angle, φ1 over q turns.

    With φ1 = qt the equation is a trigonometric polynomial in t, an algebraic one in exp(it);
    the roots on the unit circle are counted.
    """
    l0, l1, l2, l3 = lengths
    p, q = i24.numerator, i24.denominator
    n = max(abs(p), abs(q), abs(p - q))
    phi4 = np.atleast_1d(phi4)
    c = np.zeros((len(phi4), 2 * n + 1), complex)
    c[:, n] = l0**2 + l1**2 + l2**2 - l3**2
    turned = np.exp(1j * float(i24) * phi4)
    for order, phase, size in (
        (q, np.ones_like(turned), l0 * l1),
        (p - q, 1 / turned, -l0 * l2),
        (p, 1 / turned, -l1 * l2),
    ):
        c[:, n + order] += size * phase
        c[:, n - order] += size / phase
    companion = np.zeros((len(phi4), 2 * n, 2 * n), complex)
    companion[:, np.arange(1, 2 * n), np.arange(2 * n - 1)] = 1
    companion[:, :, -1] = -c[:, :-1] / c[:, -1:]
    z = np.linalg.eigvals(companion)
    return (np.abs(np.abs(z) - 1) < 1e-6).sum(axis=1)


def middles(counts: Any, phi4: Any) -> dict[int, float]:
    """Return for every count that occurs the wheel angle in the middle of its widest interval."""
    edges = [0, *(np.flatnonzero(np.diff(counts)) + 1).tolist(), len(counts)]
    best: dict[int, tuple[int, float]] = {}
    for a, b in pairwise(edges):
        count = int(counts[a])
        if b - a > best.get(count, (0, 0.0))[0]:
            best[count] = (b - a, float(phi4[(a + b - 1) // 2]))
    return {count: angle for count, (_, angle) in sorted(best.items())}


@dataclass(frozen=True)
class Turning:
    """Angle and its derivatives by the wheel's angle, of one body over wheel angles."""

    angle: Any
    speed: Any
    acceleration: Any


def assembled(phi4: Any, side: str) -> dict[str, Turning]:
    """Return the example's bodies at wheel angles on one assembly (+ or −), followed from 0."""
    at = (0.0, *np.atleast_1d(phi4).tolist())
    task = md.Sweep(driver=md.Driver(coordinate="wheel.angle", at=at, speed=1.0))
    bodies = md.solve(five(), task, mode=label(side)).bodies
    names = ("angle", "angular_velocity", "angular_acceleration")
    return {b: Turning(*(series[n][1:] for n in names)) for b, series in bodies.items()}


@cache
def label(side: str) -> str:
    """Return mechdae's label of an assembly of the example at wheel angle 0."""
    found = wheel_modes(EXAMPLE, Fraction(-1), 0.0)
    crank = found.bodies["crank"].angle
    for k, labels in enumerate(found.labels):
        if abs(crank[k]) < 1 and (crank[k] > 0) == (side == "+"):
            return ",".join(labels)
    raise ArithmeticError("no such assembly")


def equations() -> list[str]:
    """Return the verdicts on equations (1) to (16)."""
    l0, l1, l2, l3 = EXAMPLE
    i42 = -1.0
    i24 = 1 / i42
    phi4 = np.arange(16) * np.pi / 4
    motion = [assembled(phi4, side) for side in "+−"]
    names = ("crank", "coupler", "rocker", "wheel")
    f1, f2, f3, f4 = (np.concatenate([run[b].angle for run in motion]) for b in names)
    w1, w2, _, w4 = (np.concatenate([run[b].speed for run in motion]) for b in names)
    a0, a1, a2, a3 = l0**2 + l1**2 + l2**2 - l3**2, 2 * l0 * l1, 2 * l0 * l2, 2 * l1 * l2
    A, B = a3 * np.cos(i24 * f4), a3 * np.sin(i24 * f4)
    C, D = a2 * np.cos(i24 * f4), a2 * np.sin(i24 * f4)
    K, F = a1 - A, C + a0
    c1, s1 = np.cos(f1), np.sin(f1)
    x = np.tan(f1 / 2)
    quartic = coefficients(f4)
    powers = np.array([x**k for k in (4, 3, 2, 1, 0)])
    terms = np.array(quartic) * powers
    e = {
        1: np.abs(l0 + l1 * np.exp(1j * f1) - l2 * np.exp(1j * f2) - l3 * np.exp(1j * f3)) / l0,
        2: (l0**2 + l1**2 + l2**2 + a1 * c1 - a2 * np.cos(f2) - a3 * np.cos(f1 - f2) - l3**2)
        / a0,
        4: (a1 * c1 - a2 * np.cos(f2) - a3 * np.cos(f1 - f2) + a0) / a0,
        5: (c1 * (a1 - a3 * np.cos(f2)) - a2 * np.cos(f2) - a3 * s1 * np.sin(f2) + a0) / a0,
        6: (w4 - w1) / (w2 - w1) - i42,
        7: w4 - w2 * i42 - w1 * (1 - i42),
        8: w4 / w1 - (w2 / w1 * i42 + 1 - i42),
        10: f4 - (i42 * f2 + (1 - i42) * f1),
        11: f2 - (i24 * f4 - (i24 - 1) * f1),
        12: (a1 * c1 - A * np.cos(i24 * f1) - B * np.sin(i24 * f1) - C * np.cos((i24 - 1) * f1)
             - D * np.sin((i24 - 1) * f1) + a0) / a0,
        13: (K * c1 + B * s1 - C * np.cos(2 * f1) + D * np.sin(2 * f1) + a0) / a0,
        14: (K * c1 + B * s1 - 2 * C * c1**2 + 2 * D * c1 * s1 + F) / a0,
        15: terms.sum(axis=0) / np.abs(terms).sum(axis=0),
    }  # fmt: skip
    left = {n: below(float(np.abs(v).max()), 1e-12) for n, v in e.items()}
    one = wheel_modes(EXAMPLE, Fraction(1), 1.0).summary
    num = l1 * np.sin(f1) - l2 * np.sin(f2)
    wrong = num**2 + (l0 + l2 * np.cos(f2) - l1 * c1) ** 2 - l3**2
    rule = 4 * l0 * (l2 * np.cos(f2) - l1 * c1)
    if np.abs(wrong - rule).max() > 1e-15:
        raise ArithmeticError("the misfit of (16) is not 4 l0 (l2 cos φ2 − l1 cos φ1)")
    ways = "right"
    rows = [
        ["(1)", ways, f"loop closed, {left[1]} of l0"],
        ["(2), (3)", ways, left[2]],
        ["(4)", ways, left[4]],
        ["(5)", ways, left[5]],
        ["(6)", ways, f"ratio of the speeds, and minus for an external mesh: {left[6]}"],
        ["(7)", ways, left[7]],
        ["(8), (9)", ways, left[8]],
        ["(10)", "right, constant of integration dropped",
         f"{left[10]} with the constant 0; the announced φ40 is never used"],
        ["(11)", ways, left[11]],
        ["(12)", "right, its exception is none",
         f"{left[12]}. Only a gear pair with i24 = 1 cannot be built; the equation then has "
         f"{one['count']} roots (at φ4 = 1)"],
        ["(13)", ways, left[13]],
        ["(14)", ways, left[14]],
        ["(15)", ways, f"{left[15]} of the sum of its terms; coefficients below"],
        ["(16)", "**wrong**", "signs in the denominator, and arctan for a two-argument "
         "arctangent; below"],
    ]  # fmt: skip
    lines = [
        f"Residuals at {len(f4)} poses of mechdae: φ4 = kπ/4 over two turns of the wheel, both "
        "assemblies.",
        "",
        *table("equation | verdict | residual", rows),
        "**Coefficients of (15).** At one wheel angle the four modes of mechdae give four roots "
        "tan(φ1/2). The monic quartic with these roots, times the article's *a*, against the "
        "article's coefficients:",
        "",
    ]
    body = []
    for k, value in enumerate((0.7, 2.0, 4.0)):
        crank = wheel_modes(EXAMPLE, Fraction(-1), value).bodies["crank"].angle
        printed = np.array([float(c) for c in coefficients(value)])
        ours = printed[0] * np.poly(np.tan(crank / 2))
        gap = float(np.abs(ours - printed).max() / np.abs(printed).max())
        for which, numbers in (("article", printed), ("mechdae", ours)):
            shown = [text(v, 9, 1e-13) for v in numbers]
            body.append([f"{value:g}", which, *shown, below(gap, 1e-11) if which > "b" else ""])
        if len(crank) != 4 or k > 3:
            raise ArithmeticError("four roots expected")
    lines += table("φ4 | | a | b | c | d | e | difference", body)
    arc = np.arctan(num / (l0 + l2 * np.cos(f2) - l1 * c1))
    good = np.arctan2(num, l0 + l1 * c1 - l2 * np.cos(f2))
    agrees = below(float(np.abs(np.exp(1j * good) - np.exp(1j * f3)).max()), 1e-12)
    body = [
        [f"{text(f4[k] / np.pi, 3)}π", "+", text(f3[k], 12), text(arc[k], 12), text(good[k], 12)]
        for k in range(0, 8)
    ]
    lines += [
        "**Formula (16).** By (1) the denominator is l0 + l1 cos φ1 − l2 cos φ2. As printed, "
        "numerator and denominator are not even the legs of a triangle with the hypotenuse l3: "
        "their squares miss l3² by 4 l0 (l2 cos φ2 − l1 cos φ1), at these poses by up to "
        f"{text(float(np.abs(wrong).max() / l3**2), 6)} l3². With the right denominator and both "
        f"signs kept it agrees with mechdae ({agrees}).",
        "",
        *table("φ4 | assembly | φ3, mechdae | (16) as printed | (16) corrected", body),
    ]
    return lines


def coefficients(phi4: Any) -> tuple[Any, ...]:
    """Return a to e of the article's equation (15)."""
    l0, l1, l2, l3 = EXAMPLE
    a0, a1, a2, a3 = l0**2 + l1**2 + l2**2 - l3**2, 2 * l0 * l1, 2 * l0 * l2, 2 * l1 * l2
    A, B = a3 * np.cos(-phi4), a3 * np.sin(-phi4)
    C, D = a2 * np.cos(-phi4), a2 * np.sin(-phi4)
    K, F = a1 - A, C + a0
    return -K - 2 * C + F, 2 * B - 4 * D, 4 * C + 2 * F, 2 * B + 4 * D, K - 2 * C + F


def four_roots() -> list[str]:
    """Return the section on the number of real roots."""
    angles = [float(v) for v in np.arange(24) * np.pi / 12]
    found = [wheel_modes(EXAMPLE, Fraction(-1), v) for v in angles]
    counts = sorted({r.summary["count"] for r in found})
    if counts != [4] or not all(r.summary["proven"] for r in found):
        raise ArithmeticError("four proven modes expected")
    (least, _), (most, _) = rate_range(EXAMPLE)
    here, ahead = assembled([1.0, 1.0 + 2 * np.pi], "+")["crank"].angle
    modes = wheel_modes(EXAMPLE, Fraction(-1), 1.0)
    crank = np.sort(np.mod(modes.bodies["crank"].angle, 2 * np.pi))
    both = all(np.abs(np.exp(1j * crank) - np.exp(1j * v)).min() < 1e-12 for v in (here, ahead))
    if not both:
        raise ArithmeticError("the + assembly one wheel turn on is not among the modes")
    lines = [
        f"**False for the article's own example**: at each of {len(angles)} wheel angles (15° "
        "apart) mechdae finds 4 modes and proves the number. The reason: dφ4/dφ1 = 2 − φ2′ stays "
        f"between {text(2 - most, 9, 1e-12)} and {text(2 - least, 9, 1e-12)} and averages 2, so "
        "one turn of the crank takes two of the wheel, and each of the two assemblies passes the "
        "same wheel position twice, at different crank angles. At φ4 = 1 the roots are φ1 = "
        f"{', '.join(text(v, 9) for v in crank)}; the + assembly has {text(here, 9)} there and "
        f"{text(ahead, 9)} one wheel turn later. Picking *the two real roots* is not a rule; a "
        "root has to be followed.",
        "",
        "Number of real roots for other ratios and link lengths (l0, l1, l2, l3). With i24 = p/q "
        "in lowest terms equation (12) has 2 max(|p|, |q|, |p − q|) roots over q turns of φ1. "
        "Every number was found over 720 wheel angles from the polynomial, and is the number of "
        "assembly modes mechdae finds, and proves, in the middle of the widest interval that has "
        "it.",
        "",
    ]
    grid = np.arange(720) * 2 * np.pi / 720
    body = []
    for i24 in RATIOS:
        p, q = i24.numerator, i24.denominator
        row = [sign(str(i24)), sign(str(1 / i24)), str(2 * max(abs(p), abs(q), abs(p - q)))]
        for lengths in SETS.values():
            spots = middles(real_roots(lengths, i24, grid), grid)
            for count, angle in spots.items():
                modes = wheel_modes(lengths, 1 / i24, angle)
                if modes.summary["count"] != count or not modes.summary["proven"]:
                    raise ArithmeticError(f"{i24}, {lengths}, {angle}: {count} roots")
            seen = [str(count) for count in spots]
            row.append("/".join(seen) if len(seen) > 1 else f"**{seen[0]}**")
        body.append(row)
    titles = [f"{name} ({', '.join(f'{v:g}' for v in lengths)})" for name, lengths in SETS.items()]
    lines += table(" | ".join(["i24", "i42", "roots", *titles]), body)
    lines += [
        "Bold: the same at every wheel angle. *Two* is right for i24 = −1 in the double crank and "
        "with the short coupler, for the article's crank-rocker it is right at no angle.",
        "",
    ]
    return lines


def dead_points(lengths: tuple[float, ...], i42: Fraction) -> list[float]:
    """Return the wheel angles (within a turn) at which dφ4/dφ1 = 0, in closed form."""
    i = float(i42)
    found = []
    for side in (1, -1):
        for phi1 in roots(lambda a, s=side: coupler_rate(lengths, a, s)[1] - (1 - 1 / i)):
            phi2, _ = coupler_rate(lengths, phi1, side)
            found.append(i * float(phi2) + (1 - i) * phi1)
    return found


def full_turns() -> list[str]:
    """Return the section on the full rotatability of the input wheel."""
    (least, at_least), (most, at_most) = rate_range(EXAMPLE)
    crank2 = SETS["double crank"]
    (low2, _), (high2, _) = rate_range(crank2)
    cases = [(EXAMPLE, "example", 1 / i24, least, most) for i24 in RATIOS]
    cases += [(crank2, "double crank", Fraction(i), low2, high2) for i in (-1, -2, -3)]
    body = []
    for lengths, name, i42, low, high in sorted(cases, key=lambda c: (c[1] != "example", c[2])):
        i = float(i42)
        mode = None
        if lengths != EXAMPLE:
            mode = ",".join(wheel_modes(lengths, i42, 0.0).labels[0])
        run = wheel_window(lengths, i42, mode)
        predicted = not low < 1 - 1 / i < high
        ends = run.summary["limits"]
        if predicted != (ends == [None, None]):
            raise ArithmeticError(f"{name}, i42 = {i42}: limits {ends}, predicted {predicted}")
        if predicted:
            # the range of dφ4/dφ1 is monotone in φ2′
            a, b = sorted((1 - i * (1 - low), 1 - i * (1 - high)))
            turns = round(abs(np.ptp(run.drivers["wheel.angle"].position)) / (2 * np.pi))
            said = f"turns fully; closes after {turns} turn{'s' if turns > 1 else ''} of the wheel"
            shown = f"{text(a, 6, 1e-9)} … {text(b, 6, 1e-9)}"
        else:
            # whole turns of crank and coupler shift φ4 by parts of a turn
            known = np.array(dead_points(lengths, i42)) * i42.denominator
            gap = max(
                float(np.abs(np.exp(1j * known) - np.exp(1j * i42.denominator * end)).min())
                for end in ends
            )
            below(gap, 1e-9)
            said = "dead points at φ4 = " + " and ".join(
                f"{fixed(np.degrees(end), 6)}°" for end in ends
            )
            shown = "changes sign"
        body.append(
            [name, sign(str(i42)), text(1 - 1 / i, 6), "yes" if predicted else "no", shown, said]
        )
    lines = [
        "With i = i42 and φ2′ = dφ2/dφ1, dφ4/dφ1 = 1 − i (1 − φ2′): the input wheel has a dead "
        "point where φ2′ = 1 − 1/i, and turns fully where φ2′ never takes that value. In the "
        f"example φ2′ runs from {text(least, 10, 1e-12)} (φ1 = {text(at_least, 6, 1e-9)}) to "
        f"{text(most, 10, 1e-12)} (φ1 = {text(at_most, 6, 1e-9)}), in the double crank of the "
        f"table above from {text(low2, 8, 1e-12)} to {text(high2, 8, 1e-12)}. So an external pair "
        "(i < 0) with the shortest link as the crank of a Grashof four-bar always turns, because "
        "φ2′ < 1; with an internal pair it depends on the numbers. The last column is mechdae "
        "following the motion; every dead point it meets agrees with the closed form (difference "
        "below 10⁻⁹ rad).",
        "",
        *table("links | i42 | 1 − 1/i | turns | dφ4/dφ1 | mechdae", body),
    ]
    short = SETS["short coupler"]
    mode = ",".join(wheel_modes(short, Fraction(-1), 0.0).labels[0])
    rocks = wheel_window(short, Fraction(-1), mode)
    if rocks.summary["limits"] != [None, None]:
        raise ArithmeticError("the wheel of the short coupler should turn fully")
    lines += [
        "The crank need not be a crank: with the short coupler and i = −1 the wheel turns fully "
        f"(swing {text(rocks.summary['swing']['wheel'] / np.pi, 6)}π, no dead point), the coupler "
        f"turns with it, and link 1 only rocks by {text(rocks.summary['swing']['crank'], 11)} rad.",
        "",
    ]
    return lines


def biggest_turn() -> tuple[float, float, float]:
    """Return the largest and the least crank turn over one wheel turn, and where the first is."""
    step = 4 * np.pi / 720
    grid = np.arange(1081) * step
    speed = assembled(grid, "+")["crank"].speed
    gap = speed[360:] - speed[:-360]

    def difference(s: float) -> float:
        w = assembled([s, s + 2 * np.pi], "+")["crank"].speed
        return float(w[1] - w[0])

    found = []
    for k in np.flatnonzero(gap[:-1] * gap[1:] < 0):
        a, b, fa, fb = grid[k], grid[k + 1], gap[k], gap[k + 1]
        for _ in range(4):
            s = b - fb * (b - a) / (fb - fa)
            a, fa, b, fb = b, fb, s, difference(s)
            if abs(fb) < 1e-13:
                break
        angle = assembled([b, b + 2 * np.pi], "+")["crank"].angle
        found.append((float(angle[1] - angle[0]), float(b)))
    return max(found)[0], min(found)[0], max(found)[1]


def swing_and_claims() -> list[str]:
    """Return the example's numbers and the conclusions with verdicts."""
    l0, l1, l2, l3 = EXAMPLE
    run = md.solve(five(), "turns")
    swing = run.summary["swing"]["rocker"]
    closed = np.arccos((l0**2 + l3**2 - (l1 + l2) ** 2) / (2 * l0 * l3)) - np.arccos(
        (l0**2 + l3**2 - (l2 - l1) ** 2) / (2 * l0 * l3)
    )
    below(abs(swing - closed), 1e-12)
    one = md.Sweep(driver=md.Driver(coordinate="wheel.angle", from_=0, to=2 * np.pi), poses=361)
    half = {
        side: md.solve(five(), one, mode=label(side)).summary["swing"]["rocker"] for side in "+−"
    }
    (_, at_least), (_, at_most) = rate_range(EXAMPLE)
    rates = []
    for phi1 in (at_least, at_most):
        phi2, _ = coupler_rate(EXAMPLE, phi1, 1)
        at = float(-phi2 + 2 * phi1) % (4 * np.pi)
        rates.append(float(assembled(at, "+")["crank"].speed[0]))
        phi2_rate = coupler_rate(EXAMPLE, phi1, 1)[1]
        below(abs(rates[-1] - 1 / (2 - float(phi2_rate))), 1e-12)
    grid = np.arange(16) * np.pi / 4
    motion = assembled(grid, "+")
    w1, w2 = (motion[b].speed for b in ("crank", "coupler"))
    e1, e2 = (motion[b].acceleration for b in ("crank", "coupler"))
    slope = w2 / w1
    bend = (e2 - slope * e1) / w1**2
    below(float(np.abs(w1 - 1 / (-slope + 2)).max()), 1e-12)
    exact = below(float(np.abs(e1 - bend / (2 - slope) ** 3).max()), 1e-12)
    top, bottom, where = biggest_turn()
    obeying = (0.075, 0.06, 0.1, 0.07)
    mode = ",".join(wheel_modes(obeying, Fraction(-1), 0.0).labels[0])
    stuck = wheel_window(obeying, Fraction(-1), mode).summary["limits"]
    if None in stuck:
        raise ArithmeticError("the non-Grashof set should have dead points")
    long, rest = obeying[1] + obeying[2], obeying[0] + obeying[3]
    lines = [
        f"**Swing of link 3.** Printed {PRINTED_SWING} rad; mechdae {text(swing, 13)} rad "
        f"({text(np.degrees(swing), 12)}°), and the difference of the two arccosines of the "
        f"four-bar's extreme positions gives the same. Deviation "
        f"{percent(float(PRINTED_SWING), swing)} %. The swing belongs to the four-bar and does not "
        f"depend on the wheels; over a single turn of the wheel from φ4 = 0 link 3 covers only "
        f"{text(half['+'], 8)} rad (+) or {text(half['−'], 8)} rad (−). "
        f"{PRINTED_SWING} rad is {fixed(np.degrees(float(PRINTED_SWING)), 2)}°: probably 77° "
        "read off a graph.",
        "",
        f"**Full turn with variable speed.** Right, but it takes two turns of the input: dφ1/dφ4 "
        f"runs from {text(min(rates), 10, 1e-12)} to {text(max(rates), 10, 1e-12)}, mean 0.5.",
        "",
        "**Notation.** The ratio is i42 in (6), i24 from (11) on and i12 in the example and in "
        "the last conclusion; harmless only because −1 is its own reciprocal.",
        "",
        "**Conclusions**",
        "",
    ]
    rows = [
        ["1. The position function is not explicit", "**too strong**",
         "a quartic has roots in radicals, and the inverse is explicit: "
         "φ4 = iφ2(φ1) + (1 − i)φ1. Hence φ1′ = 1/(iφ2′ + 1 − i) and "
         f"φ1″ = −iφ2″/(iφ2′ + 1 − i)³ without any differencing; mechdae agrees, {exact}"],
        ["2. Positions only as a table", "**false**",
         "same reason: for every φ1 the wheel angle, and for every wheel angle the derivatives, "
         "are formulas"],
        ["3. The wheel turns fully when l1 < l3 < l0 < l2", "**false**",
         f"not necessary: the example itself has l0 = {l0:g} > l2 = {l2:g} and turns, so does the "
         f"double crank. Not sufficient: ({', '.join(f'{v:g}' for v in obeying)}) obeys it, but "
         f"shortest and longest make {long:g} > {rest:g}, and mechdae meets dead points at φ4 = "
         f"{' and '.join(fixed(np.degrees(v), 3) + '°' for v in stuck)} (i = −1). Of lengths drawn "
         "at random half fail: l → 1 − l turns the inequality round. Right is: link 1 the "
         "shortest of a Grashof four-bar and an external pair, or a bound on φ2′ as above"],
        ["3b. The crank must be coaxial with the wheel", "**not necessary**",
         "the short coupler above: the wheel turns, link 1 rocks"],
        ["4. Largest crank turn per input turn 0.5(1 − i12)", "**false**",
         "the formula has no link lengths in it, and a largest turn depends on them. In units of π "
         "it is the mean turn 2π/(1 − i), but for i = −1 and i = 3 only. Over one turn of the "
         f"wheel the crank makes at most {text(top, 12, 1e-13)} rad (from φ4 = "
         f"{text(where, 6, 1e-8)}, assembly +), at least {text(bottom, 12, 1e-13)} rad and in the "
         "mean π"],
        ["Text after (15): rates of link 1 by differencing its table", "**unnecessary**",
         "the two formulas beside conclusion 1 are exact"],
        ["Unevenness of the driven crank", "right", "see the range of dφ1/dφ4"],
    ]  # fmt: skip
    return lines + table("claim | verdict | why", rows)


PLACES: list[tuple[str, ...]] = [
    ("Fig. 1, geared five-bar", f"problem `{FIVE}`", "geared_five_bar_diagram"),
    ("Fig. 2, differential of mobility two: link 3 is off", "problem `differential`",
     "differential_diagram"),
    ("(1)-(16)", "[equations](#equations-1-to-16)"),
    ("two real roots of four", "[roots](#of-the-four-roots-only-two-can-be-real)"),
    ("example, Fig. 3: φ1(φ4) and its analogue; swing of link 3",
     "task `turns` with ω4 = 1; [example](#example-and-conclusions)", "geared_five_bar_curves"),
    ("analogues by numerical differentiation", "exact rates; [example](#example-and-conclusions)"),
    ("conclusions 1 to 4", "[example and conclusions](#example-and-conclusions)"),
    ("the input wheel turns fully", "[full turns](#when-the-input-wheel-turns-fully)"),
    ("synthesis of such mechanisms (refs 1, 3)",
     "problems `gear5-g1`, `gear5-g3`; [synthesis](synthesis.md)"),
    ("law φ4(t), initial angle φ40",
     "keys `law` and `phase`; [problem file](../../reference/problem-file.md)"),
]  # fmt: skip
"""Parts of the article, where they are here, and their pictures."""


def lines() -> list[str]:
    """Return the section of the page."""
    return [
        "## Geared five-bar",
        "",
        "R. V. Ambartsumyants, A. P. Lipin, S. A. Romashkevich, *Kinematic research of the geared "
        f"five-bar linkages mechanism*, 2018 (article 004). Problem `{FIVE}`: l0 = 0.1, "
        "l1 = 0.048, l2 = 0.09, l3 = 0.08 m, i42 = −1; D at the origin, A at (l0, 0), the input is "
        "the wheel on A.",
        "",
        *places(PLACES),
        "### Equations (1) to (16)",
        "",
        *equations(),
        '### "Of the four roots only two can be real"',
        "",
        *four_roots(),
        "### When the input wheel turns fully",
        "",
        *full_turns(),
        "### Example and conclusions",
        "",
        *swing_and_claims(),
    ]
