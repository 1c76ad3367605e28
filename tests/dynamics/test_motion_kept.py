"""What is kept for motions and equilibria: warm calls build nothing and give what first ones do."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.motion.kinematics import prepared

G = 9.81


def machine() -> dict[str, Any]:
    """A pair of wheels under a table of torques, a loose disc, a rod that rubs in its pin."""
    turning = {"kind": "revolute"}
    return {
        "schema": 1,
        "gravity": [0, -G],
        "parameters": {
            "J": 0.02, "m": 0.4, "I": 0.01, "T": 2.0, "f": 0.2, "late": 0.1, "i": -2.0,
            "turn": 10.0,
        },
        "ground": {"points": {"A": [0, 0], "B": [0.3, 0], "C": [1, 0.5], "D": [2, 0]}},
        "bodies": {
            "one": {"points": {"A": [0, 0]}, "mass": 1.0, "inertia": 0.01},
            "two": {"points": {"B": [0, 0]}, "mass": 1.0, "inertia": 0.03},
            "disc": {"points": {"C": [0, 0]}, "inertia": "J"},
            "rod": {"points": {"D": [0, 0], "P": [0.5, 0.1]}, "mass": "m", "center": [0.2, 0],
                    "inertia": "I"},
            "bob": {"points": {"P": [0, 0]}, "mass": "m", "center": [0.3, 0], "inertia": 0.01},
        },
        "joints": {
            "A": {**turning, "between": ["ground.A", "one.A"]},
            "B": {**turning, "between": ["ground.B", "two.B"]},
            "C": {**turning, "between": ["ground.C", "disc.C"]},
            "D": {**turning, "between": ["ground.D", "rod.D"], "friction": "f",
                  "pin_radius": 0.01},
            "P": {**turning, "between": ["rod.P", "bob.P"]},
            "mesh": {"kind": "gear", "between": ["one.A", "two.B"], "ratio": "i"},
        },
        "sketch": {"one_deg": 0, "two_deg": 0, "disc_deg": "turn", "rod_deg": -30, "bob_deg": 0},
        "loads": {
            "gust": {"kind": "table", "coordinate": "t", "body": "one", "shift": "late",
                     "rows": [[0, 0], [0.5, 1], [1.5, -1], [1.9, 0]], "period": "T",
                     "factor": 0.1},
        },
        "tasks": {"m": {"kind": "motion", "until": 1.0, "tolerance": 1e-8}},
    }  # fmt: skip


def outcome(problem: md.Problem, task: str, values: dict[str, float]) -> str:
    """Return what a task gives as text."""
    try:
        return repr(md.solve(problem, task, set=values).to_dict())
    except md.MechdaeError as error:
        return f"{type(error).__name__}: {error}"


def fresh(problem: md.Problem, task: str, values: dict[str, float]) -> str:
    """Return the same with nothing kept."""
    prepared.SHAPES.clear()
    return outcome(problem, task, values)


@cache
def as_it_is() -> str:
    return fresh(from_dict(machine()), "m", {})


CHANGES: dict[str, list[dict[str, float]]] = {
    "other values": [{"m": 0.5, "f": 0.1}, {"T": 3.0, "late": 0.2}, {"i": -3.0}],
    "a disc that nothing moves": [{"J": 0.0}, {"J": 0.0, "turn": 0.3}, {"J": 0.03}],
    "no friction": [{"f": 0.0}, {"f": 0.3}],
    "a mass matrix that is singular": [{"m": 0.0, "I": 0.0, "f": 0.0}, {"m": 0.0}, {"m": 0.4}],
    "a period that is that of the table, and one that is too short": [{"T": 1.9}, {"T": 1.0}],
}


@pytest.mark.parametrize("case", CHANGES)
def test_numbers_that_change_the_equations(case: str) -> None:
    """Warm as fresh to the last bit where values decide what is held, rubs, repeats, has mass."""
    problem = from_dict(machine())
    changes: list[dict[str, float]] = [{}, *CHANGES[case], {}]
    wanted = [as_it_is(), *(fresh(problem, "m", values) for values in CHANGES[case]), as_it_is()]
    prepared.SHAPES.clear()
    assert [outcome(problem, "m", values) for values in changes] == wanted
    assert len(prepared.SHAPES) == 1
    assert len(set(wanted)) > 1


TASKS = [
    ("andrews-squeezer", "motion", "m1"),
    ("four-bar-motor", "motion", "T0"),
    ("belt-stick-slip", None, "k"),
    ("coasting-slider-crank", None, "m"),
    ("double-pendulum", "rest", "l1"),
    ("n-four-bar", "motion", "m"),
]


def started(name: str, task: str | None, key: str | None) -> tuple[md.Solver, dict[str, float]]:
    """Return a solver that was called once, and another value of one number."""
    problem = md.load(name)
    task = task or next(own for own, found in problem.tasks.items() if found.kind == "motion")
    values = problem.mechanism.values()
    if key not in problem.mechanism.parameters:
        key = next(n for n, v in problem.mechanism.parameters.items() if isinstance(v, float) and v)
    solver = md.Solver(problem, task)
    solver().to_dict()
    return solver, {key: values[key] * 1.001}


@pytest.mark.parametrize(("name", "task", "key"), TASKS)
def test_warm_calls_build_nothing(
    name: str, task: str | None, key: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []
    real = ca.Function

    class Counted(real):  # type: ignore[misc, valid-type]
        def __init__(self, *given: Any) -> None:
            made.append(str(given[0]) if given else "")
            super().__init__(*given)

    monkeypatch.setattr(ca, "Function", Counted)
    solver, values = started(name, task, key)
    assert made
    made.clear()
    sizes = [shape.size for shape in prepared.SHAPES.values()]
    solver(values).to_dict()
    # what a law says of the time is one graph without the state: its series has the numbers in it
    assert [own for own in made if own not in ("known", "timed", "tempo")] == []
    assert [shape.size for shape in prepared.SHAPES.values()] == sizes


def test_two_threads_give_the_same_bits() -> None:
    problem = md.load("andrews-squeezer")
    masses = [problem.mechanism.values()["m1"] * (1 + 1e-3 * k) for k in range(8)]
    wanted = [fresh(problem, "motion", {"m1": own}) for own in masses]
    prepared.SHAPES.clear()
    solver, gate = md.Solver(problem, "motion"), threading.Barrier(2)

    def some(order: list[float]) -> list[str]:
        gate.wait()
        return [repr(solver(m1=own).to_dict()) for own in order]

    with ThreadPoolExecutor(2) as pool:
        one, other = (pool.submit(some, own) for own in (masses, masses[::-1]))
    assert one.result() == wanted
    assert other.result() == wanted[::-1]


def test_many_equations_cost_one_decomposition_each_at_passages(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A ladder of 12 parallelograms, 24 equations: none at the steps between singular poses."""
    from tests.reference.pendulums import passages

    counts = {"svd": 0, "eigvalsh": 0}
    for name in counts:
        real = getattr(np.linalg, name)

        def counted(*given: Any, name: str = name, real: Any = real, **keys: Any) -> Any:
            counts[name] += 1
            return real(*given, **keys)

        monkeypatch.setattr(np.linalg, name, counted)
    result = md.solve("n-four-bar", "motion", set={"N": 12, "tol": 1e-9, "t_end": 10.0})
    times = [event["at"] for event in result.events if event["kind"] == "singular"]
    assert np.abs(np.array(times) - passages(12, len(times))).max() < 1e-6
    assert len(times) >= 5
    assert all(event["rank_drop"] == 12 for event in result.events)
    assert counts["svd"] <= 3 * len(times) + 12
    assert counts["eigvalsh"] <= 2
