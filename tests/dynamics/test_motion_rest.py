"""Laws of time that start from rest, stand still or are held, beside springs and weights.

The truth is a four-bar in closed form: its poses, and the work of the driver as the difference
of the energies at rest.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.dynamics.task import OPEN
from mechdae.errors import InconsistentStartError
from tests.attack import equilibria

TURN = 0.2
LAWS = {
    "cycloid": "a + b*(t/2 - sin(2*pi*t/2)/(2*pi))",
    "polynomial": "a + b*(10*(t/2)**3 - 15*(t/2)**4 + 6*(t/2)**5)",
    "harmonic": "a + b*(1 - cos(pi*t/2))/2",
    "rate that vanishes but for rounding": "a + b*(1 + cos(pi*(t/2 + 1)))/2",
    "constant": "a",
    "held": None,
}


def case_with(seed: int, kind: str) -> tuple[equilibria.Case, Any]:
    """Return a random four-bar with springs and weights, its crank on a law of time."""
    case, generator = equilibria.drawn(seed)
    while case.slider or case.angles(case.theta + TURN) is None or case.slope(case.theta) is None:
        seed += 1000
        case, generator = equilibria.drawn(seed)
    data = case.data(generator)
    data["bodies"]["rocker"] |= {"mass": 1e-3, "inertia": 1e-3}
    data["parameters"] = {"a": case.theta, "b": TURN}
    law = LAWS[kind]
    driver = {"coordinate": "crank.angle"} | ({"at": ["a"]} if law is None else {"law": law})
    data["tasks"] = {"go": {"kind": "motion", "drivers": [driver], "until": 2.0}}
    return case, from_dict(data)


@pytest.mark.parametrize(
    ("seed", "kind"), [(i, [*LAWS][(i + k) % len(LAWS)]) for i in range(20) for k in (0, 2)]
)
def test_laws_from_rest_beside_springs(seed: int, kind: str) -> None:
    case, problem = case_with(seed, kind)
    result = md.solve(problem, "go")
    assert result.fault is None
    end = case.theta + (TURN if kind not in ("constant", "held") else 0.0)
    wanted = case.angles(end)
    for body, angle in zip(("crank", "rod", "rocker"), wanted, strict=True):
        gap = math.remainder(float(result.bodies[body].angle[-1]) - angle, 2 * math.pi)
        assert abs(gap) < 1e-12, body
    size = abs(case.energy(complex(case.theta)).real) + 1.0
    # the rocker's centre is its pin: what is lifted and stretched is in the energy of the case
    lifted = (case.energy(complex(end)) - case.energy(complex(case.theta))).real
    work = float(result.work["drivers"][-1])
    assert work == pytest.approx(lifted, abs=1e-7 * size)


def test_the_old_scale_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """What forces leave by rounding, over rates that are zero, made every start singular."""

    def wrong(setup: Any, x: Any, v: Any) -> None:
        k = setup.kernel
        k.scale(0.0, x, v, setup.loose)
        _, _, J, gamma = k.value("parts", 0.0, x, v, setup.loose)
        a = k.value("rhs", 0.0, x, v, setup.loose)[0].ravel()
        left = np.max(np.abs(J @ a - gamma.ravel()))
        if left > OPEN * max(np.max(np.abs(gamma)), np.max(np.abs(a)), 1e-300):
            raise InconsistentStartError("the pose is singular")

    monkeypatch.setattr("mechdae.dynamics.task.check_rest", wrong)
    refused = 0
    for seed in range(5):
        try:
            md.solve(case_with(seed, "constant")[1], "go")
        except InconsistentStartError:
            refused += 1
    assert refused


def test_a_law_that_rests_at_a_dead_point() -> None:
    """A crank is held at its dead point: nothing asks for speeds there."""
    data = {
        "schema": 1,
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "crank": {"points": {"O": [0, 0], "B": [0.1, 0]}, "mass": 1.0, "inertia": 0.01},
            "rod": {"points": {"B": [0, 0], "C": [0.3, 0]}, "mass": 1.0, "inertia": 0.01},
            "slider": {"points": {"C": [0, 0]}, "mass": 1.0, "inertia": 0.01},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "crank.O"]},
            "B": {"kind": "revolute", "between": ["crank.B", "rod.B"]},
            "C": {"kind": "revolute", "between": ["rod.C", "slider.C"]},
            "guide": {"kind": "prismatic", "between": ["ground.O", "slider.C"]},
        },
        "sketch": {"crank": 0.0, "rod": 0.0},
        "tasks": {
            "held": {
                "kind": "motion",
                "drivers": [{"coordinate": "crank.angle", "law": "0.1*(1 - cos(t))"}],
                "until": 1.0,
            }
        },
    }
    result = md.solve(from_dict(data), "held")
    angle = 0.1 * (1 - math.cos(1.0))
    across = math.asin(0.1 * math.sin(angle) / 0.3)
    place = 0.1 * math.cos(angle) + 0.3 * math.cos(across)
    assert result.joints["guide"].slide[-1] == pytest.approx(place, rel=1e-12)


@pytest.mark.parametrize("seed", [21, *range(8)])
def test_a_start_far_from_the_sketch_keeps_its_mode(seed: int) -> None:
    """The named coordinate is moved along the branch of the sketch: 21 leapt to the other one."""
    case, generator = equilibria.drawn(seed)
    ahead, back = case.arc()
    theta = float(generator.uniform(0.98 * back[-1] + 0.02 * ahead[-1],
                                    0.02 * back[-1] + 0.98 * ahead[-1]))  # fmt: skip
    data = case.data(generator)
    data["bodies"].get("rocker", {}).update({"mass": 1.0, "inertia": 0.1})
    data["tasks"] = {"go": {"kind": "motion", "start": {"crank.angle": theta}, "at": [0.0, 1e-4]}}
    result = md.solve(from_dict(data), "go")
    gap = math.remainder(float(result.bodies["rod"].angle[0]) - case.angles(theta)[1], 2 * math.pi)
    assert abs(gap) < 1e-8


def test_a_leap_to_the_other_mode_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: the way from the sketch does not look at the sign of the Jacobian."""
    monkeypatch.setattr("mechdae.dynamics.start._Starter._side", lambda *_: 0.0)
    with pytest.raises(AssertionError):
        test_a_start_far_from_the_sketch_keeps_its_mode(21)
