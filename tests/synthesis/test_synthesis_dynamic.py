"""Goals and limits of a synthesis on motions and equilibria, against closed forms."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.design.synthesis.outcome import Outcome, TaskRun
from mechdae.errors import InputError, MechdaeError, UnknownName
from tests.shared.block import X0, C, K, M, block, course

TURN = 2 * math.pi


def wanted(goal: Any, free: Any, *limits: Any, **more: Any) -> dict[str, Any]:
    """Return a task of synthesis on the block."""
    return {
        "kind": "synthesis", "driver": {"coordinate": "guide.slide"}, "starts": 2, "seed": 1,
        "free": free, "goal": goal, "constraints": list(limits), **more,
    }  # fmt: skip


def best(problem: Any) -> Any:
    """Return the best design; its own file gives the number it claims."""
    result = md.solve(problem, "design")
    assert not result.fault, (result.fault, result.summary)
    return result.data["designs"][0]


def limit(path: str, **ends: float) -> dict[str, Any]:
    return {"kind": "limit", "of": path, **ends}


def test_the_softest_spring_for_a_natural_frequency() -> None:
    goal = {"kind": "minimise", "of": "rest/outputs/stiff/value"}
    task = wanted(goal, {"k": [10, 400]}, limit("rest/summary/frequencies/0", min=1.2))
    design = best(with_stiffness(block(design=task)))
    exact = M * ((TURN * 1.2) ** 2 + (C / (2 * M)) ** 2)
    assert design["parameters"]["k"] == pytest.approx(exact, rel=1e-7)
    assert "lower limit of summary/frequencies/0" in design["active"]


def with_stiffness(problem: Any) -> Any:
    """Return the block with its stiffness among the outputs."""
    data = tomllib.loads(md.dumps(problem))
    return from_dict({**data, "outputs": {"x": "guide.slide", "stiff": "k"}})


def rod(**tasks: Any) -> Any:
    """Return a uniform rod of 1.2 m that hangs from a pivot at x from its middle."""
    return from_dict(
        {
            "schema": 1,
            "gravity": [0, -9.81],
            "parameters": {"x": 0.5, "L": 1.2, "m": 3.0},
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"rod": {"points": {"G": [0, 0], "A": ["x", 0]}, "mass": "m",
                               "center": [0, 0], "inertia": "m*L**2/12"}},
            "joints": {"pivot": {"kind": "revolute", "between": ["ground.O", "rod.A"]}},
            "sketch": {"rod_deg": 80},
            "tasks": {"rest": {"kind": "equilibrium", "linearise": True}, **tasks},
        }
    )  # fmt: skip


def test_the_pivot_of_a_rod_with_the_shortest_period() -> None:
    task = {
        "kind": "synthesis", "driver": {"coordinate": "rod.angle"}, "starts": 3,
        "free": {"x": [0.05, 0.6]},
        "goal": {"kind": "maximise", "of": "rest/summary/frequencies/0"},
    }  # fmt: skip
    design = best(rod(design=task))
    x = 1.2 / math.sqrt(12)
    assert design["parameters"]["x"] == pytest.approx(x, rel=1e-5)
    swift = math.sqrt(9.81 * x / (1.2**2 / 12 + x * x)) / TURN
    assert design["objective"] == pytest.approx(swift, rel=1e-9)


def test_the_softest_spring_that_is_there_in_time() -> None:
    goal = {"kind": "minimise", "of": "go/last/outputs/stiff/value"}
    task = wanted(goal, {"k": [20, 60]}, limit("go/last/x", max=0.2), starts=1)
    tasks = {"go": {"kind": "motion", "start": {"guide": "x0"}, "until": 0.2}}
    design = best(with_stiffness(block(**tasks, design=task)))
    low, high = 20.0, 60.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if course(0.2, M, middle, C, X0) > 0.2 else (low, middle)
    assert design["parameters"]["k"] == pytest.approx(low, rel=1e-6)
    # the design's own file gives what it claims
    own = md.solve(from_dict(tomllib.loads(design["problem"])), "go")
    assert own.value("outputs/x/value")[-1] == pytest.approx(0.2, rel=1e-6)


def test_a_counterweight_for_the_least_peak_effort() -> None:
    # moment of the weights is m (l + w cx, w cy): its length is least at w = -l cx / |c|^2
    cx, cy, m = -0.6, 0.3, 2.0
    problem = from_dict(
        {
            "schema": 1,
            "gravity": [0, -9.81],
            "parameters": {"w": 0.3, "m": m},
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"arm": {"points": {"A": [0, 0]}, "mass": "m", "inertia": 0.5,
                               "center": [f"1 + w*({cx})", f"w*{cy}"]}},
            "joints": {"pivot": {"kind": "revolute", "between": ["ground.O", "arm.A"]}},
            "tasks": {
                "go": {"kind": "motion", "until": "2*pi",
                       "drivers": [{"coordinate": "arm.angle", "law": "t"}]},
                "design": {
                    "kind": "synthesis", "driver": {"coordinate": "arm.angle"}, "starts": 1,
                    "free": {"w": [0, 3]},
                    "goal": {"kind": "minimise", "of": "go/peak/efforts/arm.angle"},
                },
            },
        }
    )  # fmt: skip
    design = best(problem)
    size = math.hypot(cx, cy)
    assert design["parameters"]["w"] == pytest.approx(-cx / size**2, rel=1e-4)
    assert design["objective"] == pytest.approx(m * 9.81 * cy / size, rel=1e-7)


def test_what_cannot_be_computed_is_no_value(monkeypatch: pytest.MonkeyPatch) -> None:
    """A task that fails in part of the range."""
    task = {
        "kind": "synthesis", "driver": {"coordinate": "rod.angle"}, "starts": 1,
        "free": {"x": [0.05, 0.6]},
        "goal": {"kind": "maximise", "of": "rest/summary/frequencies/0"},
    }  # fmt: skip
    problem = rod(design=task)
    # where the task fails beyond a place, the search stays on the side where it does not
    solved = TaskRun.slopes

    def fails(self: TaskRun, d: Any) -> Any:
        if d[0] < 0.4:
            self._values[d.tobytes()] = {"summary/frequencies/0": math.nan}
            return {"summary/frequencies/0": np.array([math.nan])}
        return solved(self, d)

    monkeypatch.setattr(TaskRun, "slopes", fails)
    result = md.solve(problem, "design")
    assert result.data["designs"]
    for design in result.data["designs"]:
        assert design["parameters"]["x"] >= 0.4
        assert math.isfinite(design["objective"])


def test_a_value_that_the_task_does_not_give_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    right = TaskRun.values

    def wrong(self: TaskRun, d: Any) -> dict[str, float]:
        return {path: 1.01 * value for path, value in right(self, d).items()}

    monkeypatch.setattr(TaskRun, "values", wrong)
    task = {
        "kind": "synthesis", "driver": {"coordinate": "rod.angle"}, "starts": 1,
        "free": {"x": [0.05, 0.6]},
        "goal": {"kind": "maximise", "of": "rest/summary/frequencies/0"},
    }  # fmt: skip
    result = md.solve(rod(design=task), "design")
    assert result.data["designs"] == []
    assert "from the sketch of the file" in str(result.fault)


@pytest.mark.parametrize(
    ("of", "more", "match"),
    [
        ("rest/summary/frequenzies/0", {}, "frequencies"),
        ("go/outputs/x/value", {}, "last/outputs/x/value"),
        ("go/last/y", {}, "y"),
        ("rest/summary/stable", {}, "not a number"),
        ("go/last/x", {"reduce": "mean"}, "nothing to reduce"),
        ("og/last/x", {}, "go"),
    ],
)
def test_bad_paths(of: str, more: dict[str, Any], match: str) -> None:
    task = wanted({"kind": "minimise", "of": of, **more}, {"k": [20, 60]})
    problem = block(design=task, go={"kind": "motion", "until": 0.05})
    with pytest.raises(MechdaeError, match=match) as caught:
        md.solve(problem, "design")
    assert isinstance(caught.value, InputError | UnknownName)
    assert "goal" in str(caught.value)


def test_a_parameter_without_effect_is_refused() -> None:
    goal = {"kind": "minimise", "of": "go/last/x"}
    problem = block(
        design=wanted(goal, {"c": [1, 5], "x0": [0.1, 0.2]}),
        go={"kind": "motion", "start": {"guide": 0.4}, "until": 0.05},
    )
    with pytest.raises(InputError, match="does not depend on 'x0'"):
        md.solve(problem, "design")


def test_a_sweep_and_an_equilibrium_in_one_problem() -> None:
    data = tomllib.loads(md.dumps(rod()))
    data["bodies"]["rod"]["points"]["E"] = [-0.6, 0]
    sweep = {"coordinate": "rod.angle", "from": 0, "to": 1.0}
    swift = {"kind": "maximise", "of": "rest/summary/frequencies/0"}
    data["tasks"]["turn"] = {"kind": "sweep", "driver": sweep}
    data["tasks"]["design"] = task = {
        "kind": "synthesis", "driver": {"coordinate": "rod.angle"}, "starts": 2,
        "free": {"x": [0.05, 0.6]}, "goal": swift,
        "constraints": [limit("turn/points/rod.E/velocity", max=0.8)],
    }  # fmt: skip
    # the end of the rod is 0.6 + x from the pivot and turns with 1 rad/s
    assert best(from_dict(data))["parameters"]["x"] == pytest.approx(0.2, rel=1e-8)
    task["goal"] = {"kind": "minimise", "of": "turn/points/rod.E/velocity"}
    task["constraints"] = [limit("rest/summary/frequencies/0", min=0.55)]
    # w^2 (L^2 / 12 + x^2) = g x
    w = TURN * 0.55
    x = (9.81 - math.sqrt(9.81**2 - 4 * w**4 * 0.12)) / (2 * w * w)
    assert best(from_dict(data))["parameters"]["x"] == pytest.approx(x, rel=1e-7)


def settling(c: float, k: float = K) -> tuple[float, list[float]]:
    """Return the time until 2 % are left of the block's slowest motion, and its derivatives."""
    d, w = c / (2 * M), (c / (2 * M)) ** 2 - k / M
    rate, slopes = d, [1 / (2 * M), 0.0]
    if w > 0:
        root = math.sqrt(w)
        rate, slopes = d - root, [(1 - d / root) / (2 * M), 1 / (2 * M * root)]
    time = math.log(50) / rate
    return time, [-time / rate * slope for slope in slopes]


def test_critical_damping_is_found_at_the_kink(monkeypatch: pytest.MonkeyPatch) -> None:
    """The least settling time, by closed form in the search, by the task in the verification."""
    seen: set[tuple[float, ...]] = set()

    def value(self: Outcome, d: Any) -> float:
        seen.add(tuple(np.ravel(d).tolist()))
        return settling(*np.ravel(d).tolist())[0]

    def gradient(self: Outcome, d: Any) -> Any:
        return np.array(settling(*np.ravel(d).tolist())[1][: np.size(d)])

    monkeypatch.setattr(Outcome, "value", value)
    monkeypatch.setattr(Outcome, "gradient", gradient)
    goal = {"kind": "minimise", "of": "rest/summary/settling_time"}
    found = md.solve(block(design=wanted(goal, {"c": [0.5, 60]}, starts=3)), "design")
    design = found.data["designs"][0]
    assert design["parameters"]["c"] == pytest.approx(2 * math.sqrt(K * M), rel=1e-7)
    assert design["objective"] == pytest.approx(settling(2 * math.sqrt(K * M))[0], rel=1e-6)
    assert "kink" in design["note"]
    assert len(seen) < 3 * 500
    # beyond it the goal bends down to its bound, which has a gradient
    design = md.solve(block(design=wanted(goal, {"c": [21, 60]})), "design").data["designs"][0]
    assert design["parameters"]["c"] == pytest.approx(21, rel=1e-9)
    assert "note" not in design
    # damped as little as the file is, its spring does not matter: elsewhere it does
    free = {"c": [0.5, 60], "k": [10, 90]}
    design = md.solve(block(design=wanted(goal, free)), "design").data["designs"][0]
    assert "kink" in design["note"]
    c, k = (design["parameters"][name] for name in "ck")
    assert design["objective"] == pytest.approx(settling(c, k)[0], rel=1e-6)
