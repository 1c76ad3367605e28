"""Designs drawn at random that do what is asked, and askings that they do not meet.

Truth is a closed form of each linkage. What is claimed of a design is that it has no error (of a
straight line: the deviation of its closed form). It does; and asked for the same mirrored, in
reverse, shifted, or on its other assembly mode, it does not: each must be seen.

    python -m tests.attack.planted_designs --count 300
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.writing import dumps
from mechdae.describe.tasks.goals import FunctionTargets, Rocker, StraightLine, Visits
from mechdae.design.synthesis.verification.claims import Claim, Stated, disagreement
from mechdae.design.synthesis.verification.design_file import DesignFile
from mechdae.design.synthesis.verification.verify import measured
from mechdae.parts.types.described.composition import asked_of
from mechdae.parts.types.schemes.verified import verified
from tests.reference.closure_fourbar import FourBar, SliderCrank

TURN = 2 * np.pi
SIZE = 0.05
"""Least way of what is drawn, in cranks or radians: what hardly moves is hardly mirrored."""


# -- mechanisms ------------------------------------------------------------------------------------


def four_bar(generator: Any) -> FourBar:
    """Return a crank-rocker that transmits well, anywhere and with a coupler point."""
    while True:
        a, b, c = generator.uniform([0.2, 0.8, 0.7], [0.5, 1.5, 1.3])
        cosines = [(b * b + c * c - (1 + s * a) ** 2) / (2 * b * c) for s in (1, -1)]
        if a + max(1, b, c) < sum((1, b, c)) - max(1, b, c) and max(map(abs, cosines)) < 0.85:
            break
    point = complex(*generator.uniform([0.3, 0.3], [1.2, 0.9]))
    return FourBar((1.0, a, b, c), point, *generator.uniform(-1, 1, 2), generator.uniform(0, 6))


def slider_crank(generator: Any) -> SliderCrank:
    """Return an offset slider-crank."""
    r = generator.uniform(0.3, 0.6)
    return SliderCrank(r, r * generator.uniform(1.9, 3.5), r * generator.uniform(0.2, 0.6))


def mechanism(made: Any, theta: float, sign: int) -> md.Mechanism:
    """Return a linkage as a mechanism, sketched at an angle of its crank and in a mode."""
    place, turn = complex(made.x0, made.y0), np.exp(1j * made.theta0)
    slides = isinstance(made, SliderCrank)
    r2, r3 = (made.crank, made.coupler) if slides else made.lengths[1:3]
    A = r2 * np.exp(1j * theta)
    if slides:
        B = A + np.sqrt(r3**2 - (A.imag - made.offset) ** 2) * sign + 1j * (made.offset - A.imag)
        other = 1j * made.offset
    else:
        other = complex(made.lengths[0])
        B = other + made.lengths[3] * np.exp(1j * made.moved(theta, (sign,))[0]["output"])
    G = place + turn * other
    last = md.Body("slider", {"B": (0, 0)}) if slides else md.Body(
        "rocker", {"C": (0, 0), "B": (made.lengths[3], 0)})  # fmt: skip
    point = made.point or 0.5 + 0.2j
    end = (
        md.Prismatic("guide", "ground.C", "slider.B", axis=made.theta0) if slides
        else md.Revolute("C", "ground.C", "rocker.C")
    )  # fmt: skip
    angles = {"crank": A, "coupler": B - A}
    sketch = {name: float(np.angle(z)) + made.theta0 for name, z in angles.items()}
    sketch |= {"slider": made.theta0, "guide.slide": float(B.real)} if slides else {
        "rocker": float(np.angle(B - other)) + made.theta0}  # fmt: skip
    return md.Mechanism(
        ground=md.Ground({"O": (place.real, place.imag), "C": (G.real, G.imag)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (r2, 0)}),
            md.Body("coupler", {"A": (0, 0), "B": (r3, 0), "P": (point.real, point.imag)}), last,
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"), md.Revolute("A", "crank.A", "coupler.A"),
            md.Revolute("B", "coupler.B", f"{last.name}.B"), end,
        ],
        sketch=sketch,
    )  # fmt: skip


def design(made: Any, at: Any, sign: int, turns: bool = False) -> DesignFile:
    """Return a linkage as the file of a design at angles of its crank from the ground line."""
    problem = md.Problem(mechanism(made, float(at[0]), sign), {})
    at = np.asarray(at) + made.theta0
    return DesignFile(problem, "crank.angle", at, turns, dyads=True)


# -- what is seen ----------------------------------------------------------------------------------


def seen(stated: Stated, claim: Claim, file: DesignFile, claimed: float = 0.0) -> bool:
    """Return whether a design is told not to do what is claimed of it."""
    part = measured(stated, claim, file)
    return bool(part.defects or disagreement(part.value, claimed, stated.unit, False))


Case = tuple[str, bool]
"""What is planted, and whether it is seen."""


def angles(generator: Any, count: int = 5) -> Any:
    """Return angles of the crank in order within a turn, apart from each other."""
    steps = generator.uniform(0.4, 1.0, count)
    return generator.uniform(0, TURN) + np.cumsum(steps)


def functions(generator: Any) -> Iterator[Case]:
    """A rocker's angle and a block's slide by targets, from free starts and by a formula."""
    for made, output in ((four_bar(generator), "rocker.angle"), (slider_crank(generator), "")):
        at = angles(generator)
        x, sign = at + made.theta0, 1
        y = made.moved(at, (sign,))[0]["output"]
        if output:
            y = np.unwrap(y + made.theta0)
        if np.ptp(y) < SIZE or np.ptp(np.diff(y)) < SIZE:
            continue
        name = "function" if output else "slide"
        file = design(made, at, sign)
        goal = FunctionTargets(output=output or "guide.slide")

        def asked(ys: Any, free: bool = False, goal: Any = goal, x: Any = x) -> Stated:
            rows = tuple(zip(x.tolist(), ys.tolist(), strict=True))
            own = replace(goal, targets=rows, sense="free" if free else "given")
            return Stated(replace(own, input_start=rows[0][0], output_start=rows[0][1]))

        # the search may say that the output turns the other way
        told, back = Claim(x, sense=1.0), Claim(x, sense=-1.0)
        yield f"{name}: sound", seen(asked(y), told, file)
        yield (
            f"{name}: sound, mirrored in a free sense",
            seen(asked(2 * y[0] - y, True), back, file),
        )
        yield f"{name}: mirrored", seen(asked(2 * y[0] - y), back, file)
        yield f"{name}: reversed", seen(asked(y[::-1]), told, file)
        yield f"{name}: shifted", seen(asked(y + 0.02), told, file)
        if output:
            other = design(made, at, -sign)
            yield f"{name}: other mode", seen(asked(y), told, other)


def paths(generator: Any) -> Iterator[Case]:
    """A coupler point by the crank's values, by steps and in order; a body's poses."""
    made, at = four_bar(generator), angles(generator)
    z = made.moved(at, (1,))[0]["point"]
    u, file, other = at + made.theta0, design(made, at, 1), design(made, at, -1)
    goal = Visits("coupler.P", (), "absolute", tuple(u.tolist()), False, (1.0,) * len(u), "")

    def asked(spots: Any, **changes: Any) -> Stated:
        rows = tuple(zip(spots.real.tolist(), spots.imag.tolist(), strict=True))
        return Stated(replace(goal, targets=rows, measure="least-squares", **changes))

    line = z[0] + np.conj((z - z[0]) * np.exp(-0.3j)) * np.exp(0.3j)
    steps = {"timing": "steps", "programme": tuple((u - u[0] + 0.7).tolist())}
    free: dict[str, Any] = {"timing": "free", "programme": ()}
    yield "path: sound", seen(asked(z), Claim(u), file)
    yield "path: sound, steps", seen(asked(z, **steps), Claim(u), file)
    yield "path: sound, free", seen(asked(z, **free), Claim(u), file)
    yield "path: mirrored", seen(asked(line), Claim(u), file)
    yield "path: reversed", seen(asked(z[::-1]), Claim(u), file)
    yield "path: shifted", seen(asked(z + 0.01), Claim(u), file)
    yield "path: other mode", seen(asked(z), Claim(u), other)
    yield "path: other times", seen(asked(z, programme=tuple((u + 0.1).tolist())), Claim(u), file)
    stretched = replace_programme(steps, 1.1)
    yield "path: other steps", seen(asked(z, **stretched), Claim(u), file)
    order = [0, 2, 1, 3, 4]
    yield "path: out of order", seen(asked(z[order], **free), Claim(u[order]), file)


def replace_programme(keys: dict[str, Any], factor: float) -> dict[str, Any]:
    return keys | {"programme": tuple(factor * own for own in keys["programme"])}


def motions(generator: Any) -> Iterator[Case]:
    """Poses of a coupler: the origin of its frame and its angle."""
    made, at = four_bar(generator), angles(generator, 4)
    A = made.lengths[1] * np.exp(1j * at)
    B = made.lengths[0] + made.lengths[3] * np.exp(1j * made.moved(at, (1,))[0]["output"])
    place = complex(made.x0, made.y0) + np.exp(1j * made.theta0) * A
    turn = np.angle(B - A) + made.theta0
    u, file, other = at + made.theta0, design(made, at, 1), design(made, at, -1)

    def asked(z: Any, angle: Any, measure: str = "least-squares") -> Stated:
        rows = tuple(zip(z.real.tolist(), z.imag.tolist(), angle.tolist(), strict=True))
        weights = (1.0,) * len(rows)
        return Stated(Visits("coupler", rows, "free", (), False, weights, measure))

    yield "motion: sound", seen(asked(place, turn), Claim(u), file)
    yield "motion: sound, exact", seen(asked(place, turn, "exact"), Claim(u), file)
    yield "motion: mirrored", seen(asked(place, 2 * turn[0] - turn), Claim(u), file)
    yield "motion: reversed", seen(asked(place[::-1], turn[::-1]), Claim(u), file)
    yield "motion: shifted", seen(asked(place, turn + 0.02), Claim(u), file)
    yield "motion: shifted, exact", seen(asked(place, turn + 1e-6, "exact"), Claim(u), file)
    yield "motion: other mode", seen(asked(place, turn), Claim(u), other)


def rockers(generator: Any) -> Iterator[Case]:
    """Swing of a rocker and stroke of a block, with the times of both strokes, in closed form."""
    made = four_bar(generator)
    _, a, b, c = made.lengths
    ends, outputs = [], []
    for reach in (b - a, b + a):  # crank and coupler in line
        gamma = math.acos((1 + reach**2 - c**2) / (2 * reach))
        ends.append(gamma + (np.pi if reach < b else 0.0))
        outputs.append(np.angle(reach * np.exp(1j * gamma) - 1))
    swing, rise = abs(outputs[1] - outputs[0]), (ends[1] - ends[0]) % TURN
    yield from _to_and_fro("rocker", made, ends[0], rise, swing, Rocker(body="rocker"), "swing")
    slide = slider_crank(generator)
    r, rod, e = slide.crank, slide.coupler, slide.offset
    far, near = (math.sqrt((rod + s * r) ** 2 - e * e) for s in (1, -1))
    first, last = math.asin(e / (rod - r)) + np.pi, math.asin(e / (rod + r))
    goal = Rocker(joint="guide")
    yield from _to_and_fro(
        "stroke", slide, first, (last - first) % TURN, far - near, goal, "stroke"
    )


def _to_and_fro(
    name: str, made: Any, first: float, rise: float, way: float, goal: Rocker, word: str
) -> Iterator[Case]:
    at = np.array([first, first + rise])
    file = design(made, at, 1, turns=True)
    claim = Claim(at + made.theta0)
    ratio = rise / (TURN - rise)

    def asked(**changes: float) -> Stated:
        return Stated(replace(goal, **{word: way, "time_ratio": ratio} | changes))

    yield f"{name}: sound", seen(asked(), claim, file)
    yield f"{name}: shifted", seen(asked(**{word: way * 1.001}), claim, file)
    if abs(rise - np.pi) > 0.01:
        yield f"{name}: reversed", seen(asked(time_ratio=1 / ratio), claim, file)
    late = Claim(claim.at + 0.05)
    yield f"{name}: other ends", seen(asked(), late, file)


def lines(generator: Any) -> Iterator[Case]:
    """A coupler point over an arc, and a line beside which it stays by a deviation."""
    for _ in range(200):
        made, arc = four_bar(generator), generator.uniform(0.8, 1.6)
        begin = generator.uniform(0, TURN)
        at = begin + arc * np.linspace(0, 1, 721)
        z = made.moved(at, (1,))[0]["point"]
        way = float(np.angle(z[-1] - z[0]))
        along, across = (z * np.exp(-1j * way)).real, (z * np.exp(-1j * way)).imag
        if (np.diff(along) > 0).all() and along[-1] - along[0] > SIZE:
            break
    stroke = float(along[-1] - along[0])
    offset = float(across.max() + across.min()) / 2
    worst = float(np.ptp(across)) / 2 / stroke
    goal = StraightLine(point="coupler.P", arc=arc, stroke=stroke)
    claim = Claim((begin + made.theta0,), direction=way, offset=offset)
    file = design(made, at[[0, -1]], 1)
    yield "line: sound", seen(Stated(goal, unit=1e-3), claim, file, worst)
    yield "line: reversed", seen(Stated(replace(goal, arc=-arc)), claim, file, worst)
    yield (
        "line: other stroke",
        seen(Stated(replace(goal, stroke=1.01 * stroke)), claim, file, worst),
    )
    shifted = replace(claim, offset=offset + 0.01 * stroke)
    yield "line: shifted", seen(Stated(goal), shifted, file, worst)
    mirrored = replace(claim, direction=way + np.pi)
    yield "line: mirrored", seen(Stated(goal), mirrored, file, worst)
    other = design(made, at[[0, -1]], -1)
    yield "line: other mode", seen(Stated(goal), claim, other, worst)


def schemes(generator: Any) -> Iterator[Case]:
    """Compositions: a path by steps, a function, a closed curve, each with an error of zero."""
    made, at = four_bar(generator), angles(generator)
    z, u = made.moved(at, (1,))[0]["point"], at + made.theta0
    text = dumps(design(made, at, 1).problem)

    def asked(goal: dict[str, Any]) -> Any:
        return asked_of(md.Composition(goal=goal), {})

    def path(spots: Any) -> bool:
        rows = np.stack([spots.real, spots.imag], axis=1).tolist()
        own = asked({"kind": "path", "steps": (u - u[0]).tolist(), "targets": rows})
        return bool(verified(text, own, 0.0, "coupler.P", u, 1.0))

    yield "scheme: sound path", path(z)
    yield "scheme: mirrored path", path(z[0] + np.conj(z - z[0]))
    yield "scheme: reversed path", path(z[::-1])
    yield "scheme: shifted path", path(z + 0.01)
    y = np.unwrap(made.moved(at, (1,))[0]["output"] + made.theta0)

    def function(ys: Any) -> bool:
        own = asked({"kind": "function", "targets": np.stack([u, ys], axis=1).tolist()})
        return bool(verified(text, own, 0.0, "rocker.angle", u, 1.0))

    if np.ptp(y) > SIZE:
        yield "scheme: sound function", function(y)
        yield "scheme: mirrored function", function(2 * y[0] - y)
        yield "scheme: reversed function", function(y[::-1])
        yield "scheme: shifted function", function(y + 0.02)
    whole = np.linspace(0, TURN, 720, endpoint=False) + at[0]
    curve = made.moved(whole, (1,))[0]["point"]

    def shape(corners: Any) -> bool:
        rows = np.stack([corners.real, corners.imag], axis=1).tolist()
        own = asked({"kind": "curve", "targets": rows})
        return bool(verified(text, own, 1e-9, "coupler.P", u[:1], 1.0))

    # shape and size count: not where a curve lies and in which sense
    yield "scheme: sound curve", shape(np.roll(curve[::-1], 1) * 1j + 3)
    yield "scheme: curve mirrored", shape(np.conj(curve))
    yield "scheme: curve of another size", shape(1.01 * curve)
    other = made.moved(whole, (-1,))[0]["point"]
    yield "scheme: curve of the other mode", shape(other)


KINDS: dict[str, Callable[[Any], Iterator[Case]]] = {
    own.__name__: own for own in (functions, paths, motions, rockers, lines, schemes)
}


def wrong(kind: str, count: int, seed: int = 0) -> tuple[dict[str, int], list[str]]:
    """Return how often each case was planted, and what was seen wrongly."""
    planted: dict[str, int] = {}
    bad = []
    for k in range(count):
        for name, told in KINDS[kind](np.random.default_rng([seed, k])):
            planted[name] = planted.get(name, 0) + 1
            if told == ("sound" in name):
                bad.append(f"{name} of number {k}")
    return planted, bad


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--count", type=int, default=300)
    reader.add_argument("--seed", type=int, default=0)
    given = reader.parse_args()
    for kind in KINDS:
        planted, bad = wrong(kind, given.count, given.seed)
        for name, times in planted.items():
            print(f"{name:40} {times}")
        print(f"{kind}: {len(bad)} seen wrongly {bad[:10]}")


if __name__ == "__main__":
    main()
