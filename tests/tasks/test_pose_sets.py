"""Poses with a set of numbers for each row: closed forms, statuses, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.errors import InputError
from tests.reference.closed_forms import four_bar_crank_rocker
from tests.reference.jets import derivatives


def test_each_row_is_the_closed_form_of_its_set() -> None:
    """Lanes for all; a number that is none, or makes none, costs its row alone."""
    rng = np.random.default_rng(5)
    n = 64
    b, c, u = rng.uniform(0.11, 0.125, n), rng.uniform(0.075, 0.085, n), rng.uniform(-3, 9, n)
    bad = {3: (np.nan, 0.08), 5: (0.0, 0.08), 13: (0.9, 0.08)}
    for row, (first, second) in bad.items():
        b[row], c[row] = first, second
    u[21] = np.inf
    solver = md.Solver("four-bar-crank-rocker", "turn", vary=["b", "c"])
    poses = solver.poses({"b_mm": 1e3 * b, "c": c}, u)
    good = np.setdiff1d(np.arange(n), [*bad, 21])
    assert poses.ok[good].all()
    assert poses.status[[*bad, 21]].tolist() == ["unassembled"] * 4
    assert set(poses.faults) == set(bad)
    assert "zero length" in poses.faults[5]
    assert np.isnan(poses["bodies/rocker/angle"][[*bad, 21]]).all()
    value, slope = derivatives(four_bar_crank_rocker, u[good], 1, b=b[good], c=c[good])
    bound = 4 * poses.error[good].max(axis=1) + 1e-14
    place = poses["points/coupler.P/position"][good] @ [1, 1j]
    assert (np.abs(place - value["coupler.P"]) <= bound).all()
    turn = np.exp(1j * poses["bodies/rocker/angle"][good])
    assert (np.abs(turn - np.exp(1j * value["rocker"])) <= bound).all()
    speed = poses["bodies/rocker/angular_velocity"][good]
    assert np.allclose(speed, 10 * slope["rocker"], rtol=0, atol=1e-11)
    found = poses.jacobian("bodies/rocker/angle")[good, 0, 0]
    assert np.allclose(found, slope["rocker"], rtol=0, atol=1e-12)
    rows = solver.poses(np.stack([b, c], axis=1), u)
    assert np.allclose(rows["bodies/rocker/angle"], poses["bodies/rocker/angle"], equal_nan=True)


@pytest.mark.parametrize("task", ["forward", "circle"])
def test_sets_of_several_drivers(task: str) -> None:
    """Each row is what its set alone gives: numbers, proof and status."""
    solver = md.Solver("five-bar-robot", task, vary=["a", "b"])
    sets = np.array([[0.2, 0.3], [0.21, 0.29], [0.2, 0.3], [0.2, np.nan], [0.19, 0.31]])
    u = [[2.2, 0.9], [2.25, 0.85], [2.1, 1.0], [2.2, 0.9], [np.nan, 0.9]]
    u = u if task == "forward" else [[0.1, 0.35], [0.12, 0.3], [0.1, 0.9], [0.1, 0.35], [np.nan, 1]]
    poses = solver.poses(sets, u)
    assert poses.status[3:].tolist() == ["unassembled"] * 2
    for row in range(3):
        alone = md.Solver("five-bar-robot", task).poses(
            dict(zip("ab", sets[row].tolist(), strict=True)), [u[row]]
        )
        assert poses.status[row] == alone.status[0]
        for path in ("points/tip.P/position", "bodies/left/angle"):
            assert np.allclose(poses[path][row], alone[path][0], atol=1e-13, equal_nan=True)
            slope = alone.jacobian(path)[0]
            assert np.allclose(poses.jacobian(path)[row], slope, atol=1e-11, equal_nan=True)


def test_one_of_either_counts_for_all() -> None:
    solver = md.Solver("four-bar-crank-rocker", "turn", vary=["b"])
    many = solver.poses({"b": [0.12]}, [0.5, 0.6])
    assert np.allclose(
        many["bodies/rocker/angle"], solver.poses({}, [0.5, 0.6])["bodies/rocker/angle"]
    )
    lone = solver.poses({"b": [np.nan]}, 0.5)
    assert lone["bodies/rocker/angle"].shape == (1,)
    assert lone.faults[0] == "a number is not finite"


@pytest.mark.parametrize(
    ("values", "u", "says"),
    [
        ([0.12, 0.13], 0.5, r"parameters: \(n, 1\): b are needed, not \(2,\)"),
        ([[0.12, 0.1]], 0.5, r"not \(1, 2\)"),
        ({"b": [[0.12]]}, 0.5, "b: one value for each row"),
        ({"b": [0.12, 0.13], "c": [0.08]}, 0.5, "2 of b, 1 of c"),
        ({"b": ["x"]}, 0.5, "numbers are needed"),
        ({"b": [0.12, 0.13]}, [1, 2, 3], "2 sets of numbers and 3 values"),
        ({"b": [0.12, 0.13]}, [[1, 2], [3, 4]], "values of crank.angle are needed"),
        ({"bb": [0.12, 0.13]}, 0.5, "unknown parameter 'bb'"),
    ],
)
def test_what_is_refused(values: object, u: object, says: str) -> None:
    solver = md.Solver("four-bar-crank-rocker", "turn", vary=["b"])
    with pytest.raises(InputError, match=says):
        solver.poses(values, u)
