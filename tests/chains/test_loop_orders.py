"""Orders of several vector loops: what assembles closes, what is refused cannot be assembled."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.types.chains.variants.orders import cyclic
from tests.shared.loop_checks import (
    again,
    check_closed,
    tried,
    vectors_at,
    work_gap,
)
from tests.shared.vector_loops import least_gap, nodes_of

SEVEN = "seven-link-loops"


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


@pytest.mark.parametrize("turned", [False, True])
def test_loads_between_links_do_the_same_work_whatever_is_fixed(turned: bool) -> None:
    assert work_gap(turned) < 1e-9
