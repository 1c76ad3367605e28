"""What happens inside steps: slips under loads of time, pulses, events crossed twice."""

from __future__ import annotations

import json
import math
from typing import Any

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.dynamics.time_rates import Clock, StepLimit
from mechdae.dynamics.watchers import zeros
from mechdae.kernels.bounds.time_rates import ORDER, Tempo
from mechdae.results.tables import table
from tests.attack import stuck
from tests.shared.paths import ROOT

G = 9.81


def block(value: str, friction: dict[str, float] | None = None, **task: Any) -> Any:
    """Return a block of 1 kg on a guide, pushed by a force."""
    return from_dict(
        {
            "schema": 1,
            "gravity": [0, -G],
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"a": {"points": {"P": [0, 0]}, "mass": 1.0}},
            "joints": {
                "G": {"kind": "prismatic", "between": ["ground.O", "a.P"], **(friction or {})}
            },
            "loads": {"F": {"kind": "force", "point": "a.P", "value": [value, 0]}},
            "tasks": {
                "m": {
                    "kind": "motion",
                    "start": {"G.slide": 0},
                    "start_speed": {"G.slide": 0},
                    "until": 5.0,
                    **task,
                }
            },
        }
    )


def happened(result: md.Result) -> list[dict[str, Any]]:
    return [e for e in result.events if e["kind"] in ("slip", "stick", "reversal")]


# -- stuck pairs ---------------------------------------------------------------------------------


@pytest.mark.parametrize("tolerance", [1e-4, 1e-9, 1e-12])
@pytest.mark.parametrize("w", [1.0, 6.0, 60.0])
def test_a_stuck_block_starts_where_the_force_is_at_its_limit(w: float, tolerance: float) -> None:
    """F0 sin(w t) = mu_s m g."""
    problem = block(
        f"14/3*sin({w}*t)", {"friction": 0.15, "friction_static": 0.2}, tolerance=tolerance
    )
    first = happened(md.solve(problem, "m"))[0]
    assert first["kind"] == "slip"
    assert first["at"] == pytest.approx(math.asin(0.2 * 3 * G / 14) / w, rel=1e-12)


@pytest.mark.parametrize(("w", "x"), [(8, 0.0469729533), (20, 1.8809606530), (50, 10.5724262473)])
def test_a_block_on_a_shaking_table(w: float, x: float) -> None:
    """Truth by quadratures between events found by bisection."""
    problem = from_dict(
        {
            "schema": 1,
            "gravity": [0, -G],
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {
                "table": {"points": {"P": [0, 0]}},
                "a": {"points": {"P": [0, 0]}, "mass": 1.0},
            },
            "joints": {
                "T": {"kind": "prismatic", "between": ["ground.O", "table.P"]},
                "G": {
                    "kind": "prismatic",
                    "between": ["table.P", "a.P"],
                    "friction": 0.3,
                    "friction_static": 0.5,
                },
            },
            "tasks": {
                "m": {
                    "kind": "motion",
                    "drivers": [{"coordinate": "T.slide", "law": f"0.1*sin({w}*t)"}],
                    "start": {"G.slide": 0},
                    "start_speed": {"G.slide": 0},
                    "until": 5.0,
                }
            },
        }
    )
    result = md.solve(problem, "m")
    assert result.joints["G"].slide[-1] == pytest.approx(x, abs=2e-10)
    assert result.fault is None


def test_a_resistance_gives_way_to_a_torque_of_time() -> None:
    """A wheel held by 3 N m under 10 sin(10 t): it starts at asin(0.3) / 10."""
    problem = from_dict(
        {
            "schema": 1,
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"wheel": {"points": {"O": [0, 0]}, "mass": 1.0, "inertia": 0.05}},
            "joints": {"O": {"kind": "revolute", "between": ["ground.O", "wheel.O"]}},
            "loads": {
                "rub": {
                    "kind": "resistance", "coordinate": "O.angle", "negative": 3.0, "positive": 3.0,
                },
                "T": {"kind": "torque", "body": "wheel", "value": "10*sin(10*t)"},
            },
            "tasks": {"m": {"kind": "motion", "until": 5.0}},
        }
    )  # fmt: skip
    first = happened(md.solve(problem, "m"))[0]
    assert first["at"] == pytest.approx(math.asin(0.3) / 10, rel=1e-12)


def test_bdf_sees_the_slip_too() -> None:
    problem = block(
        "14/3*sin(6*t)", {"friction": 0.15, "friction_static": 0.2}, method="bdf", until=0.5
    )
    first = happened(md.solve(problem, "m"))[0]
    assert first["at"] == pytest.approx(math.asin(0.2 * 3 * G / 14) / 6, rel=1e-10)


# -- pulses, jumps -------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["explicit", "bdf"])
@pytest.mark.parametrize("tau", [0.2, 0.012, 1e-3, 1e-5])
def test_a_pulse_is_not_stepped_over(tau: float, method: str) -> None:
    """At rest nothing but the force tells of it: v = F tau sqrt(pi)."""
    problem = block(f"exp(-((t-3)/{tau})**2)/{tau}", method=method)
    result = md.solve(problem, "m")
    assert result.joints["G"].slide_velocity[-1] == pytest.approx(
        math.sqrt(math.pi), rel=1e-8 if method == "explicit" else 1e-5
    )


def test_a_small_pulse_beside_a_large_force() -> None:
    """A steady force moves the block, steps are long: the pulse adds its impulse."""
    problem = block("1000 + 10*exp(-((t-3)/0.001)**2)")
    result = md.solve(problem, "m")
    assert result.joints["G"].slide_velocity[-1] == pytest.approx(
        5000 + 0.01 * math.sqrt(math.pi), rel=1e-10
    )


@pytest.mark.parametrize("tolerance", [1e-6, 1e-12])
def test_square_waves_and_corners_are_breakpoints(tolerance: float) -> None:
    """Between them polynomials of degree two and three: exact at any tolerance."""
    square = md.solve(block("sign(sin(pi*t))", tolerance=tolerance, until=4.5), "m")
    assert square.joints["G"].slide[-1] == pytest.approx(2 + 0.125, rel=1e-13)
    assert square.joints["G"].slide_velocity[-1] == pytest.approx(0.5, rel=1e-13)
    ramp = md.solve(block("max(0, min(t - 1, 2)) - abs(t - 2)", tolerance=tolerance), "m")
    # integrals over 5 s: 2 + 2 * 2, and 2 + 4.5
    assert ramp.joints["G"].slide_velocity[-1] == pytest.approx(6 - 6.5, rel=1e-12)
    assert ramp.fault is None
    assert square.fault is None


def test_a_block_pushed_beyond_its_limit_by_a_jump() -> None:
    """A force that jumps from 1 to 4 N at 1/3 s, friction 2 N: it slides from there."""
    friction = {"friction": 2 / G}
    result = md.solve(block("2.5 + 1.5*sign(t - 1/3)", friction, until=1.0), "m")
    (slip,) = happened(result)
    assert slip["kind"] == "slip"
    assert slip["at"] == pytest.approx(1 / 3, rel=1e-14)
    assert result.joints["G"].slide[-1] == pytest.approx(2 * (2 / 3) ** 2 / 2, rel=1e-12)


def test_the_longest_step() -> None:
    problem = block("1", max_step=0.01)
    assert np.diff(md.solve(problem, "m").time).max() <= 0.01 * (1 + 1e-9)
    with pytest.raises(md.InputError, match="max_step"):
        md.solve(block("1", max_step=-1.0), "m")
    with pytest.raises(md.InputError, match="max_step"):
        block("1", max_step="nothing")


def test_a_law_with_a_corner_is_an_impact() -> None:
    problem = from_dict(
        {
            "schema": 1,
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"a": {"points": {"P": [0, 0]}, "mass": 1.0}},
            "joints": {"G": {"kind": "prismatic", "between": ["ground.O", "a.P"]}},
            "tasks": {
                "m": {
                    "kind": "motion",
                    "drivers": [{"coordinate": "G.slide", "law": "abs(t - 1)"}],
                    "until": 2.0,
                }
            },
        }
    )
    result = md.solve(problem, "m")
    assert result.fault is not None
    assert "jumps in its speed" in result.fault
    assert result.time[-1] == pytest.approx(1.0, abs=1e-14)
    assert result.events[-1]["kind"] == "impact"
    assert "a law of time jumps in its place or its speed (S9)" in table(result)


# -- events --------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", [0.9, 0.999, 0.999999])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_events_crossed_twice_in_a_step(level: float, tolerance: float) -> None:
    """sin(2 t) through a level near its top, ten periods: up and down again."""
    problem = from_dict(
        {
            "schema": 1,
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"a": {"points": {"P": [0, 0]}, "mass": 1.0}},
            "joints": {"G": {"kind": "prismatic", "between": ["ground.O", "a.P"]}},
            "loads": {"k": {"kind": "spring", "coordinate": "G.slide", "stiffness": 4.0}},
            "tasks": {
                "m": {
                    "kind": "motion",
                    "start": {"G.slide": 0},
                    "start_speed": {"G.slide": 2.0},
                    "until": 10 * math.pi,
                    "tolerance": tolerance,
                    "events": [{"coordinate": "G.slide", "crosses": level}],
                }
            },
        }
    )
    found = [event["time"] for event in md.solve(problem, "m").events]
    first = math.asin(level) / 2
    true = [k * math.pi + own for k in range(10) for own in (first, math.pi / 2 - first)]
    slack = 60 * tolerance / math.sqrt(1 - level**2) + 1e-13
    assert found == pytest.approx(true, abs=slack)


def test_events_of_the_time_alone() -> None:
    """A mechanism at rest: events that only the time crosses, 200 of them in one step."""
    problem = block("0", events=[{"coordinate": "sin(40*pi*t)", "crosses": 0.5, "name": "beat"}])
    found = [event["time"] for event in md.solve(problem, "m").events]
    true = [k / 20 + own for k in range(100) for own in (1 / 240, 5 / 240)]
    assert found == pytest.approx(true, abs=1e-13)


def test_what_is_rounding_is_no_event() -> None:
    """The height of a slider on a level guide is nothing but rounding."""
    problem = md.load("coasting-slider-crank")
    name = next(iter(problem.tasks))
    task = problem.tasks[name]
    problem = problem.with_task(
        "m", type(task)(**{
            **{key: getattr(task, key) for key in ("start", "start_speed", "until", "tolerance")},
            "events": [{"coordinate": "slide.slide.speed*0", "name": "none"}],
        })
    )  # fmt: skip
    assert not [e for e in md.solve(problem, "m").events if e["kind"] == "crossing"]


# -- bounds over cells ---------------------------------------------------------------------------

OWN = ca.SX.sym("t")
EXPRESSIONS = {
    "sin": ca.sin(3 * OWN),
    "pulse": 100 * ca.exp(-(((OWN - 3) / 0.02) ** 2)),
    "quotient": OWN**3 / (1 + OWN**2),
    "root": ca.sqrt(OWN + 1),
    "power": (1 + OWN) ** 2.5,
    "general power": (1 + OWN) ** OWN,
    "logarithm": ca.log(1 + OWN),
    "tanh": ca.tanh(5 * (OWN - 1)),
    "arctangent": ca.atan(4 * (OWN - 1)),
    "angle": ca.atan2(ca.sin(OWN) + 3, OWN),
    "sinh": ca.sinh(OWN),
    "cosh": ca.cosh(OWN - 2),
    "tangent": ca.tan(OWN / 4),
    "arcsine": ca.asin(OWN / 8),
    "arccosine": ca.acos(OWN / 8),
    "size": ca.fabs(ca.sin(OWN)),
    "largest": ca.fmax(ca.sin(OWN), 0.3),
    "sign": ca.sign(ca.sin(OWN)) * ca.cos(OWN),
    "chirp": ca.cos(OWN**2),
}


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_bounds_over_cells_hold(name: str) -> None:
    """Values and Taylor coefficients at places of random cells, by casadi's derivatives."""
    expression = EXPRESSIONS[name]
    rng = np.random.default_rng(1)
    begin = rng.uniform(0, 5, 200)
    end = begin + rng.uniform(0, 0.3, 200)
    bound = Tempo(OWN, ca.vertcat(expression)).over(begin, end)[0]
    terms = [expression]
    for k in range(1, ORDER // 2 + 1):
        terms.append(ca.jacobian(terms[-1], OWN) / k)
    function = ca.Function("terms", [OWN], terms)
    for share in np.linspace(0, 1, 7):
        at = begin + share * (end - begin)
        values = [
            np.broadcast_to(np.array(part).ravel(), at.shape) for part in function(at[None, :])
        ]
        slack = 1e-12 * np.abs(values[0]) + 1e-15
        assert (values[0] >= bound.low - slack).all()
        assert (values[0] <= bound.high + slack).all()
        for k, value in enumerate(values[1:], start=1):
            scaled = np.abs(value) * ((end - begin) / 2) ** k
            assert (scaled <= bound.terms[k] * (1 + 1e-9) + 1e-14).all(), k


# -- planted mistakes ----------------------------------------------------------------------------


def test_without_the_clock_a_pulse_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = lambda self, t: StepLimit(self.end, self.end, np.inf)  # noqa: E731
    monkeypatch.setattr(Clock, "stretch", whole)
    result = md.solve(block("exp(-((t-3)/0.001)**2)/0.001"), "m")
    assert result.joints["G"].slide_velocity[-1] == 0.0


def _ends_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plant the old mistake: nothing between nodes, no limit of steps but their error."""

    def ends(lay: Any, nodes: Any, values: Any) -> Any:
        rows, lows, highs, samples = fitted(lay, nodes, values)
        whole = (lows == 0) & (highs == 1)
        line = np.linspace(0, 1, samples.shape[1])[:, None]
        flat = samples[:, :1] * (1 - line) + samples[:, -1:] * line
        return rows[whole], lows[whole], highs[whole], flat[whole]

    fitted = zeros.fitted
    monkeypatch.setattr(zeros, "fitted", ends)
    whole = lambda self, t: StepLimit(self.end, self.end, np.inf)  # noqa: E731
    monkeypatch.setattr(Clock, "stretch", whole)


def test_looking_at_the_ends_of_steps_alone_loses_events(monkeypatch: pytest.MonkeyPatch) -> None:
    _ends_alone(monkeypatch)
    problem = block("14/3*sin(60*t)", {"friction": 0.15, "friction_static": 0.2})
    found = happened(md.solve(problem, "m"))
    true = math.asin(0.2 * 3 * G / 14) / 60
    assert not found or abs(found[0]["at"] - true) > 1e-3


# -- random loads against closed forms -------------------------------------------------------------


def test_stuck_pairs_under_random_loads() -> None:
    """A sample of `tests/attack/stuck.py`, whose 300 cases are in docs/data/stuck.json."""
    for seed, case, true in stuck.cases(16):
        found = stuck.compared(case, true)
        assert found["same"], seed
        assert found["time"] <= stuck.TIME, seed
        assert found["place"] <= 1e-8 * max(1.0, found["size"]), seed
    report = json.loads((ROOT / "docs/data/stuck.json").read_text(encoding="utf-8"))
    assert report["cases"] == 300
    assert report["wrong"] == []
    assert report["worst_time"] <= stuck.TIME


def test_the_random_loads_see_steps_that_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the clock, and looking at the ends of steps alone, most of them are missed."""
    _ends_alone(monkeypatch)
    missed = [seed for seed, case, true in stuck.cases(8) if not stuck.compared(case, true)["same"]]
    assert len(missed) >= 4


def test_values_beyond_all_numbers_have_no_dips(monkeypatch) -> None:
    """Slopes of 1e308 per step are none; a function beside them changes its sign at 0.5."""
    x = (1 - np.cos(np.pi * np.arange(zeros.DEGREE + 1) / zeros.DEGREE)) / 2
    wild = 1.7e308 * np.where(np.arange(len(x)) % 2, 1e-3, 1.0)
    samples = np.stack([0.5 - x, wild], axis=1)[None]
    part = np.zeros(1, int), np.zeros(1), np.ones(1), samples
    monkeypatch.setattr(zeros, "fitted", lambda *rest: part)
    with np.errstate(over="ignore"):
        found = zeros.changes(None, None, None, falls=True)
    assert [own.which for own in found if not own.which] == [0]
    assert found[0].low < 0.5 + 1e-9
    assert found[0].high > 0.5 - 1e-9
