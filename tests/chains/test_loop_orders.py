"""Orders of several vector loops: what assembles closes, what is refused cannot be assembled."""

from __future__ import annotations

import tomllib
from itertools import product
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.parts.types.chains.variants.orders import Orders, cyclic
from mechdae.parts.types.ranking.variants import MotionOfVaried, fault_of
from tests.shared.vector_loops import gap, least_gap, nodes_of, random_loops

SEVEN = "seven-link-loops"


def again(variant: md.Variant) -> md.Problem:
    """Return a variant's problem as its file gives it."""
    return from_dict(tomllib.loads(variant.text), variant.name)


def loops_of(problem: md.Problem) -> dict[str, list[str]]:
    closure: Any = problem.mechanism.closure
    return {name: list(loop) for name, loop in closure.loops.items()}


def vectors_at(problem: md.Problem, result: Any, k: int) -> dict[str, np.ndarray]:
    """Return the vectors (2,) of a pose, by the angles of links and the slides of joints."""
    mechanism: Any = problem.mechanism
    closure, values = mechanism.closure, mechanism.values()
    found = {}
    for name, vector in closure.vectors.items():
        body, turn = closure.directions[name]
        number = values.get(turn, turn) if isinstance(turn, str) else turn
        angle = (result.bodies[body].angle[k] if body else 0.0) + float(number)
        length = vector.length
        if length is None:
            length = result.joints[f"{name}_slide"].slide[k]
        elif isinstance(length, str):
            length = values[length]
        found[name] = length * np.array([np.cos(angle), np.sin(angle)])
    return found


def check_closed(variant: md.Variant, task: str) -> None:
    """Check that all vectors of all poses meet where the order says."""
    problem = again(variant)
    result = md.solve(problem, task, poses=3)
    for k, status in enumerate(result.status):
        if status == "ok":
            vectors = vectors_at(problem, result, k)
            size = max(float(np.hypot(*vector)) for vector in vectors.values())
            assert gap(loops_of(problem), vectors) <= 1e-12 * size, variant.name


def independent_loops(loops: dict[str, list[str]], names: list[str]) -> int:
    return len(names) - len(set(nodes_of(names, loops).values())) + 1


@pytest.mark.slow
def test_orders_of_the_seven_link_mechanism() -> None:
    problem = md.load(SEVEN)
    found = list(md.variants(problem, "order"))
    assert len(found) == md.count_variants(problem, "order")[0] == 36
    names = list(problem.mechanism.closure.vectors)  # type: ignore[union-attr]
    for variant in found:
        closed = independent_loops(variant.about["order"], names)  # type: ignore[arg-type]
        # as many loops as the original closes: the same sums, the same unknowns
        assert (not variant.fault) == (closed == 3), variant.fault
        assert f"close {closed} loops, 3 are given" in variant.fault or closed == 3
    good = [variant for variant in found if not variant.fault]
    assert len(good) == 12
    first = md.solve(again(good[0]), "pose")
    for variant in good:
        check_closed(variant, "window")
        # the vectors of all orders have the same values, their rates too
        result = md.solve(again(variant), "pose")
        for body in ("crank", "conrod", "coupler", "rocker"):
            one, other = first.bodies[body], result.bodies[body]
            assert np.abs(one.angle - other.angle).max() < 1e-12
            assert np.allclose(one.angular_velocity, other.angular_velocity, rtol=1e-10)


def test_a_link_that_keeps_its_direction_has_a_guide() -> None:
    vectors = [
        md.Vector("base", 1.0, 0.0), md.Vector("crank", 0.3), md.Vector("rod", 1.1),
        md.Vector("level", 0.4, 0.0), md.Vector("rocker", 0.8),
    ]  # fmt: skip
    loops = {"loop": ["base", "rocker", "-rod", "-level", "-crank"]}
    with pytest.raises(md.MechdaeError, match=r"vectors\.level: keeps the direction of the fixed"):
        md.from_loops(vectors, loops)
    vectors[3] = md.Vector("level", 0.4, 0.0, parallel=True)
    mechanism = md.from_loops(vectors, loops, sketch={"crank": 0.6, "rod": 0.3, "rocker": 1.2})
    assert mechanism.bodies["level_parallel"].mass is None
    problem = md.Problem(mechanism, {"turn": md.Sweep(driver=md.Driver("crank.angle", at=(0.6,)))})
    result = md.solve(problem, "turn")
    assert result.bodies["level"].angle[0] == pytest.approx(0.0, abs=1e-14)
    check_closed(md.Variant("level", problem), "turn")


def tried(rng: np.random.Generator, count: int, orders: int, starts: int) -> tuple[int, int]:
    """Check some orders of a random mechanism; return how many assemble, and how many do not."""
    net = random_loops(rng, count)
    problem = net.problem()
    motion = MotionOfVaried(problem)
    if motion.result.fault:
        return 0, 0  # a limit within the little interval
    made = Orders(problem, motion.pose)
    every = [cyclic(len(loop)) for loop in net.loops.values()]
    given = {name: (net.length(name), net.angle(name)) for name in net.ends}
    unknown = {**net.unknown, "crank": ""}
    good = bad = 0
    for _ in range(orders):
        chosen = {
            name: [net.loops[name][i] for i in choice[int(rng.integers(len(choice)))]]
            for name, choice in zip(net.loops, every, strict=True)
        }
        variant = made.of(chosen)
        fault = variant.fault or fault_of(variant)
        if not fault:
            check_closed(variant, "turn")
            good += 1
            continue
        least = least_gap(chosen, unknown, given, {}, rng, starts)
        assert least > 1e-7, (chosen, fault)
        bad += 1
    return good, bad


def test_orders_of_random_loops() -> None:
    rng = np.random.default_rng(7)
    counted = np.array([tried(rng, count, 3, 8) for count in (1, 2, 2, 3)])
    assert counted.sum(axis=0).min() >= 2


def test_what_seven_links_refuse_cannot_be_assembled() -> None:
    problem = md.load(SEVEN)
    closure: Any = problem.mechanism.closure
    values = problem.mechanism.values()
    result = md.solve(problem, "pose")
    at = vectors_at(problem, result, 0)
    given = {name: (float(np.hypot(*v)), float(np.arctan2(v[1], v[0]))) for name, v in at.items()}
    unknown = {
        name: " ".join(w for w in ("length", "angle") if getattr(vector, w) is None)
        for name, vector in closure.vectors.items()
    }
    assert {name for name, word in unknown.items() if "length" in word} == {"slot", "guide"}
    assert values["phi1"] == pytest.approx(given["crank"][1])
    unknown["crank"], along = "", {"rod": "slot"}
    rng = np.random.default_rng(3)
    orders = [cyclic(len(loop)) for loop in closure.loops.values()]
    refused = 0
    for choice in list(product(*orders))[::5]:
        loops = {n: [closure.loops[n][i] for i in order]
                 for n, order in zip(closure.loops, choice, strict=True)}  # fmt: skip
        least = least_gap(loops, unknown, given, along, rng, 12)
        possible = independent_loops(loops, list(unknown)) == 3
        assert (least < 1e-9) == possible, loops
        refused += not possible
    assert refused >= 3


def relative(result: Any, bodies: list[str], fixed: str) -> np.ndarray:
    """Return the angles (bodies, poses) of links against one of them, the ground being 0."""
    zero = np.zeros(len(result.status))
    base = result.bodies[fixed].angle if fixed in result.bodies else zero
    return np.array([result.bodies[name].angle - base for name in bodies])


def check_inversions(name: str) -> int:
    """Check that each link of a problem can be fixed; return how many motions were compared.

    They are where the driver has the same values: the relative angles of all links are equal then.
    """
    problem = md.load(name)
    bodies = list(problem.mechanism.bodies)
    compared = 0
    found = list(md.variants(problem, "inversion"))
    base: Any = again(found[0])
    task = next(iter(base.tasks))
    first = md.solve(base, task, poses=9)
    for variant in found:
        assert not variant.fault, (name, variant.name, variant.fault)
        made: Any = again(variant)
        drivers = [p.tasks[task].all_drivers for p in (base, made)]
        values = [[(d.at, d.from_, d.to) for d in some] for some in drivers]
        if values[0] != values[1] or any(d.range or d.law for d in drivers[0]):
            continue
        result = md.solve(made, task, poses=9)
        fixed = str(variant.about["fixed"])
        moving = [body for body in bodies if body != fixed and body in result.bodies]
        ok = [k for k, words in enumerate(zip(first.status, result.status, strict=True))
              if set(words) == {"ok"}]  # fmt: skip
        off = (relative(result, moving, "") - relative(first, moving, fixed))[:, ok]
        off -= 2 * np.pi * np.round(off[:, :1] / (2 * np.pi))
        assert np.abs(off).max() < 1e-9, (name, variant.name)
        compared += 1
    return compared


@pytest.mark.parametrize(("name", "links"), [("gorshkov-seven-link", 8), ("rack-and-pinion", 6)])
def test_every_link_can_be_fixed(name: str, links: int) -> None:
    assert check_inversions(name) == links
