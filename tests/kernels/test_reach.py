"""What a proved step says of earlier groups: by how much they leave their tangents, bounded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.sweep import run

PLACES = np.linspace(0.0, 1.0, 9)
CASES = (("klann-leg", "turn"), ("watt-six-bar", "turn"), ("gorshkov-seven-link", "window"))


@pytest.mark.parametrize(("name", "task"), CASES)
def test_blocks_leave_their_tangents_by_less_than_their_reach(name: str, task: str) -> None:
    """Along every third step the unknowns are solved for by Newton's method at nine places.

    The bound holds for each unknown, and is of the size of what is measured: twice the second
    derivative at the ends is exceeded by less than sixty times.
    """
    problem = md.load(name)
    setting = prepare(problem, problem.tasks[task])
    path = run(setting, problem.tasks[task]).path
    graphs, consts, n = setting.graphs, path.constants.consts, setting.graphs.nx
    tubes = [graphs.tube(b) for b in range(graphs.nb)]
    checked, tested = 0, True
    for (s, state), (t, after) in list(zip(*[iter(_nodes(path))] * 2, strict=False))[::3]:
        x, v = state[:n], state[n : 2 * n]
        away = np.zeros(n)
        for b, graph in enumerate(graphs.blocks):
            inputs = (x, v, away, [s], [1.0], np.zeros(1), [state[3 * n + b], t - s], consts)
            test, _, reach = (np.array(part).ravel() for part in tubes[b](*inputs))
            tested = bool(test[0] <= 1)
            if not tested:  # proved from its other end, or around a series
                break
            away[graph.own] = reach
        if not tested:
            continue
        off = np.abs(
            [_solved(graphs, x + v * h, s + h, consts) - x - v * h for h in PLACES * (t - s)]
        )
        assert np.all(off <= away + 1e-14 * np.abs(x))
        bent = (t - s) ** 2 * np.maximum(abs(state[2 * n : 3 * n]), abs(after[2 * n : 3 * n]))
        for graph in graphs.blocks:
            own = graph.own
            assert away[own].max() <= 60 * bent[own].max() + 1e-12 * abs(x[own]).max()
        checked += 1
    assert checked > 10


def _nodes(path: Any) -> list[tuple[float, Any]]:
    return list(zip(path.s, path.state, strict=True))


def _solved(graphs: Any, x: Any, u: float, consts: Any) -> Any:
    for _ in range(4):
        x = np.array(graphs.pose(x, [u], consts)[0]).ravel()
    return x
