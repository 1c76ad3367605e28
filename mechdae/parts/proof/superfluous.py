"""Redundant equations in the plane: which are left out, and the motion in closed form."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.errors import UnavailableError
from mechdae.parts.proof.checker import mechanism_of
from mechdae.parts.proof.checker.arithmetic import ZERO, FalseClaim, exact
from mechdae.parts.proof.checker.superfluous import EQUATIONS
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.parts.proof.checker.plane import PlanarMechanism


NEAR = 2.0**-20
"""Distance from a change point up to which ranks are proved."""
WIDER = 4
"""Factor from one distance from a change point to the next one at which a step begins."""
LOOSE = 1e-6
"""How far rates may be off whole numbers, and angles off right angles, to be taken for them."""
CLOSES = ("revolute", "weld")
Waves = dict[tuple[int, str], Fraction]
"""Factors of cos ks and sin ks by (k, "c" or "s")."""


def with_motion(
    mechanism: dict[str, Json], groups: list[list[str]], bodies: dict[str, list[str]], at: str
) -> tuple[Json, list[list[str]]]:
    """Return a mechanism with equations left out and its motion, and its groups in their order.

    `mechanism`: as a certificate has it; `bodies` is its pose at `at`. `groups`: bodies of each
    Assur group: redundant ones are divided into dyads and single bodies.
    """
    m: Any = mechanism_of(mechanism, square=False)
    left, found = _left_out(m, groups, bodies)
    motion = _motion(m, mechanism, bodies, at)
    whole = mechanism | {"superfluous": [str(k) for k in sorted(left)], "motion": motion}
    try:
        mechanism_of(whole)
    except (FalseClaim, ArithmeticError) as why:
        raise _refused(f"its numbers do not meet them exactly ({why})") from None
    return whole, found


def steps_of(first: float, last: float, crossings: list[float]) -> Json:
    """Return a path from `first` to `last` whose steps are short next to change points."""
    places = {first, last}
    for s in crossings:
        distance = NEAR
        while distance < last - first:
            places |= {s - distance, s + distance}
            distance *= WIDER
    near = [s for s in crossings if first - NEAR <= s <= last + NEAR]
    low = min([first, *(s - NEAR for s in near)])
    high = max([last, *(s + NEAR for s in near)])
    remaining = sorted(
        s for s in places if low <= s <= high and not any(abs(s - c) < NEAR / 2 for c in near)
    )
    found = list[dict[str, Any]]()
    for s, to in pairwise(remaining):
        found.append({"from": str(Fraction(s)), "to": str(Fraction(to))})
        if any(s < c < to for c in near):
            found[-1]["change_point"] = True
    return {"at": str(Fraction(remaining[0])), "to": str(Fraction(remaining[-1])), "steps": found}


def _refused(why: str) -> UnavailableError:
    return UnavailableError(f"no certificate is written of redundant equations: {why}")


def _left_out(
    m: PlanarMechanism, groups: list[list[str]], bodies: dict[str, list[str]]
) -> tuple[set[int], list[list[str]]]:
    """Return the numbers of equations that others tell, and groups that keep as many as needed."""
    rows = dict[str, range]()
    for name, joint in m.joints.items():
        first = rows[next(reversed(rows))].stop if rows else 0
        rows[name] = range(first, first + EQUATIONS.get(joint["kind"], 1))
    known, left, found = {"ground"}, set[int](), list[list[str]]()
    for group in groups:
        remaining, every = list(group), m.joints_of(group, known)
        driven = sum(name.split(".")[0] in {*group, *every} for name in m.drivers)
        if sum(len(rows[name]) for name in every) + driven == 3 * len(group):
            found.append(group)
            known |= set(group)
            continue
        while remaining:
            part, names = _next(m, remaining, known, rows)
            own_rows = [k for name in names for k in rows[name]]
            within = m.joints_of(part, known)
            left |= {k for name in within for k in rows[name]} - {*own_rows}
            if len(own_rows) > 3 * len(part):
                left.add(rows[names[1]][_dependent_row(m, names, bodies)])
            known |= set(part)
            remaining = [body for body in remaining if body not in part]
            found.append(part)
    return left, found


def _next(
    m: PlanarMechanism, remaining: list[str], known: set[str], rows: dict[str, range]
) -> tuple[list[str], list[str]]:
    """Return one body on two pins of known ones, or two of a dyad, with the joints that hold it."""
    to_known = {body: [*m.joints_of([body], known)] for body in remaining}
    for body, names in to_known.items():
        if len(names) > 1 and all(m.joints[name]["kind"] == "revolute" for name in names[:2]):
            return [body], names[:2]
    for body in remaining:
        for other in remaining:
            between = [n for n in m.joints_of([body], [other]) if n in m.joints_of([other], [body])]
            if body != other and between and to_known[body] and to_known[other]:
                names = [between[0], to_known[body][0], to_known[other][0]]
                if sum(len(rows[name]) for name in names) == 6:
                    return [body, other], names
    raise _refused("they are no dyads and links on two pins one behind the other")


def _dependent_row(m: PlanarMechanism, names: list[str], bodies: dict[str, list[str]]) -> int:
    """Return which equation of the second of two pins changes less when a body turns on the first.

    Turned about the first pin, the second one moves across the line between them.
    """
    z = [float(Fraction(v)) for body in m.bodies for v in bodies[body]]
    places = []
    for name in names:
        body, point = next(end for end in m.joints[name]["ends"] if end[0] != "ground")
        k = 3 * m.bodies.index(body)
        x, y = (float(v) for v in m.points[body][point])
        c, s = math.cos(z[k + 2]), math.sin(z[k + 2])
        places.append((z[k] + c * x - s * y, z[k + 1] + s * x + c * y))
    (x1, y1), (x2, y2) = places
    return int(abs(y2 - y1) > abs(x2 - x1))


def _motion(
    m: PlanarMechanism, mechanism: dict[str, Json], bodies: dict[str, list[str]], at: str
) -> dict[str, Any]:
    """Return x, y, angle of each body by s: rates are whole, phases right angles."""
    u = float(Fraction(at))
    z = m.claimed({"bodies": bodies}, exact(at, "at"), "at")
    slopes = m.slopes(z)[1]
    J = np.array([[float(row.get(k, ZERO)) for k in range(m.n + 1)] for row in slopes])
    rates = np.linalg.lstsq(J[:, : m.n], -J[:, m.n], rcond=None)[0]
    turns = {"ground": (0, 0)}
    for k, body in enumerate(m.bodies):
        rate, angle = rates[3 * k + 2], float(z[3 * k + 2])
        turn = (angle - round(rate) * u) / (math.pi / 2)
        if not abs(rate - round(rate)) + abs(turn - round(turn)) < LOOSE:
            raise _refused("its motion is no sum of whole harmonics")
        turns[body] = round(rate), round(turn)
    places = origins(mechanism, turns)
    if len(places) <= len(m.bodies):
        raise _refused("not all bodies are linked by pins")
    return {
        body: [*(_texts(waves) for waves in places[body]), [str(v) for v in turns[body]]]
        for body in m.bodies
    }


def origins(
    mechanism: dict[str, Json], turns: dict[str, tuple[int, int]]
) -> dict[str, tuple[Waves, Waves]]:
    """Return x, y of the origins of all bodies that pins and welds link to the ground.

    `turns` are the rate and the right angles of each body's angle.
    """
    found: dict[str, tuple[Waves, Waves]] = {"ground": ({}, {})}
    joints = [joint for joint in mechanism["joints"].values() if joint["kind"] in CLOSES]
    for _ in turns:
        for joint in joints:
            ends = [joint[key].split(".") for key in ("first", "second")]
            for (known, p), (body, q) in (ends, ends[::-1]):
                if known in found and body not in found:
                    place = _point(found[known], turns[known], mechanism["bodies"][known][p])
                    minus = [str(-Fraction(v)) for v in mechanism["bodies"][body][q]]
                    found[body] = _point(place, turns[body], minus)
    return found


def _point(
    place: tuple[Waves, Waves], turn: tuple[int, int], local: list[str]
) -> tuple[Waves, Waves]:
    """Return a place and what a turned local point adds to it."""
    (k, right), (x, y) = turn, (Fraction(v) for v in local)
    cos: Waves = {(k, "cs"[right % 2]): Fraction((1, -1, -1, 1)[right % 4])}
    sin: Waves = {(k, "sc"[right % 2]): Fraction((1, 1, -1, -1)[right % 4])}
    parts = (((place[0], 1), (cos, x), (sin, -y)), ((place[1], 1), (sin, x), (cos, y)))
    sums = [dict[tuple[int, str], Fraction](), dict[tuple[int, str], Fraction]()]
    for total, terms in zip(sums, parts, strict=True):
        for waves, factor in terms:
            for key, value in waves.items():
                total[key] = total.get(key, Fraction(0)) + value * factor
    return sums[0], sums[1]


def _texts(waves: Waves) -> list[list[str]]:
    """Return rows k, factor of cos ks, factor of sin ks."""
    return [
        [str(k), *(str(waves.get((k, word), Fraction(0))) for word in "cs")]
        for k in sorted({k for (k, _), factor in waves.items() if factor})
    ]
