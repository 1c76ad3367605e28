"""The measurement of forces: its own equations, and what it says the package does."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from benchmarks import absolute, forces
from mechdae.kernels.run.high_precision import LONG

CRANK = np.linspace(0.3, 5.9, 23)


@pytest.mark.parametrize("friction", [False, True])
def test_absolute_equations_conserve_power(friction: bool) -> None:
    """Torque times speed = losses + rate of the kinetic energy - work of the load.

    The rate is a central difference of the kinetic energy in 80-bit floats, not of the
    equations.
    """
    crank = CRANK.astype(LONG)
    y = forces.exact(crank, friction)
    moving = absolute.motion(crank)
    h = LONG(2) ** -20
    rate = (energy(crank + h) - energy(crank - h)) / (2 * h) * absolute.SPEED
    turning = np.stack(
        [
            moving.speed[:, 0],
            moving.speed[:, 1] - moving.speed[:, 0],
            moving.speed[:, 2] - moving.speed[:, 1],
            moving.speed[:, 2],
        ],
        axis=1,
    )
    f = LONG(absolute.FRICTION)
    rho = absolute.PIN * f / np.sqrt(1 + f * f) if friction else 0
    sizes = np.sqrt((y[:, :8].reshape(-1, 4, 2) ** 2).sum(axis=2))
    losses = (rho * sizes * np.abs(turning)).sum(axis=1)
    power = y[:, 8] * absolute.SPEED + absolute.LOAD * moving.speed[:, 2]
    assert np.abs(power - losses - rate).max() <= 1e-9 * np.abs(power).max()
    assert (losses.min() > 0) == friction


def energy(crank):
    moving = absolute.motion(crank)
    e = np.exp(1j * moving.angle.astype(np.clongdouble))
    ground = np.zeros(len(crank))
    speeds = [ground, absolute.CRANK * 1j * e[:, 0] * moving.speed[:, 0], ground]
    total = 0
    for k, (x, y) in enumerate(absolute.CENTERS):
        v = speeds[k] + complex(x, y) * 1j * e[:, k] * moving.speed[:, k]
        total = total + absolute.MASSES[k] * np.abs(v) ** 2 / 2
        total = total + absolute.INERTIAS[k] * moving.speed[:, k] ** 2 / 2
    return total


def test_elimination_agrees_with_lapack() -> None:
    own = absolute.equations(absolute.motion(CRANK), True)
    mine, theirs = (absolute.newton(own, solve) for solve in (absolute.elimination, absolute.dense))
    assert np.abs(mine - theirs).max() <= 1e-13 * np.abs(theirs).max()
    left = absolute.residual(own, mine)
    assert np.abs(left).max() <= 1e-14 * np.abs(mine).max()


def test_errors_of_the_package_and_what_is_recorded() -> None:
    records, _ = forces.measure((37, 600), repeats=1, compared=37)
    for record in records:
        assert {"work", "n", "ratio", "yardstick", "error", "seconds"} <= set(record)
        assert record["task"] == "reactions"
        limit = 1e-9 if record["method"] == "fsolve" else 1e-13
        assert record["error"] <= limit, record
    whole = [record for record in records if record["method"] == "whole task"]
    assert len(whole) == 4
    assert all(record["not_ok"] == 0 for record in whole)
    assert "x yardstick" in forces.table(records, [])


def test_without_scipy_a_note_stands_in_place_of_fsolve(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy", None)
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    records, notes = forces.measure((37,), repeats=1, compared=37)
    assert notes == [forces.NO_SCIPY]
    assert "fsolve" not in {record["method"] for record in records}
    assert forces.NO_SCIPY in forces.table(records, notes)


def test_the_work_of_the_stage_is_one_call_of_one_function(monkeypatch) -> None:
    """No pose needs more than the few steps of the quick function."""
    stage = forces.Stage(600, "coupled")
    made, right = [], stage.statics._of

    def of(name):
        made.append((name, right(name)))
        return made[-1][1]

    monkeypatch.setattr(stage.statics, "_of", of)
    stage.forces()
    assert [batch.evaluations for name, batch in made if name == "quick"] == [600]
    assert "_solve" not in vars(stage.statics)
    assert "_whole" not in vars(stage.statics)
