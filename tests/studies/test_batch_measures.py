"""Measures of many sets at once: closed forms, and what each set gives alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.design.studies.rows import Computer, row_of

MEASURES = ("transmission", "extremes", "time-ratio", "envelope", "curve")


def swept(name: str, measures: tuple[str, ...] = MEASURES, **driver) -> md.Problem:
    """A predefined problem with one sweep of its driver and measures."""
    problem = md.load(name)
    task = next(task for task in problem.tasks.values() if type(task) is md.Sweep)
    ends = {"from_": 0.0, "to": 2 * np.pi, **driver}
    own = replace(task.all_drivers[0], range=None, at=None, **ends)
    task = replace(task, driver=own, poses=24, measures=measures)
    return md.Problem(problem.mechanism, {"turn": task}, name=name)


def drawn(problem: md.Problem, names: str, share: float, count: int) -> np.ndarray:
    rng, base = np.random.default_rng(5), problem.mechanism.values()
    return np.stack([base[n] * (1 + share * rng.uniform(-1, 1, count)) for n in names], axis=1)


def test_a_crank_rocker_against_closed_forms() -> None:
    """Transmission angles at crank in line with the ground, dead points by the law of cosines."""
    problem = swept("four-bar-crank-rocker")
    sets = drawn(problem, "abcd", 0.05, 60)
    outputs = (
        "summary/transmission/C/min", "summary/transmission/C/at", "summary/time_ratio/rocker",
        "summary/return_angle/rocker", "summary/extremes/rocker.angle/min/value",
        "summary/swing/rocker", "summary/curve/crank.B/length", "summary/curve/crank.B/area",
        "summary/curve/rocker.C/length", "summary/envelope/bodies/crank",
    )  # fmt: skip
    found = Computer(problem, "turn", outputs, tuple("abcd"))(sets)
    assert found.together == len(sets)
    value = dict(zip(outputs, found.values, strict=True))
    a, b, c, d = sets.T.astype(np.longdouble)
    cosines = [(b * b + c * c - (d + sign * a) ** 2) / (2 * b * c) for sign in (-1, 1)]
    angles = [np.arccos(np.abs(cosine)) for cosine in cosines]
    least = np.minimum(*angles)
    assert np.abs(value["summary/transmission/C/min"] - least).max() < 4e-15
    at = np.where(angles[0] < angles[1], 0.0, np.pi)
    assert np.abs(value["summary/transmission/C/at"] - at).max() < 1e-15

    def corner(near: np.longdouble, far: np.longdouble, beside: np.longdouble) -> np.ndarray:
        return np.arccos((near * near + beside * beside - far * far) / (2 * near * beside))

    out, back = (corner(d, c, b + sign * a) for sign in (1, -1))  # crank lines at dead points
    forward = np.pi + np.abs(out - back)
    ratio = forward / (2 * np.pi - forward)
    assert np.abs(value["summary/time_ratio/rocker"] / ratio - 1).max() < 1e-14
    assert np.abs(value["summary/return_angle/rocker"] - (2 * np.pi - forward)).max() < 1e-14
    far, near = (corner(c, b + sign * a, d) for sign in (1, -1))
    assert np.abs(value["summary/swing/rocker"] - (far - near)).max() < 1e-14
    lowest = np.pi - far
    assert np.abs(value["summary/extremes/rocker.angle/min/value"] - lowest).max() < 1e-14
    assert np.abs(value["summary/curve/crank.B/length"] / (2 * np.pi * a) - 1).max() < 1e-14
    assert np.abs(value["summary/curve/crank.B/area"] / (np.pi * a * a) - 1).max() < 1e-14
    arc = 2 * c * (far - near)  # to and fro, with both dead points inside
    assert np.abs(value["summary/curve/rocker.C/length"] / arc - 1).max() < 1e-13
    box = np.abs(value["summary/envelope/bodies/crank"] - np.outer(a, [-1, 1, -1, 1]))
    assert box.max() < 1e-16


@pytest.mark.parametrize(
    ("name", "names", "share", "driver", "outputs"),
    [
        (
            "jansen-leg", "abcdefghijklm", 0.03, {"measures": ("curve",)},
            ("curve/lower.P/length", "curve/lower.P/area", "curve/lower.P/closed"),
        ),
        (
            "slider-crank-offset", "re", 0.1, {"from_": 0.3, "to": -4.0},
            ("extremes/guide.slide/max/value", "extremes/guide.slide/min/at", "stroke/guide",
             "time_ratio/guide", "return_angle/rod", "curve/rod.P/closed"),
        ),
        (
            "whitworth-quick-return", "", 0.05, {},
            ("time_ratio/guide", "transmission/slot/max", "extremes/link.angle/max/value"),
        ),
    ],
)  # fmt: skip
def test_rows_are_those_of_the_sets_alone(
    name: str, names: str, share: float, driver: dict, outputs: tuple[str, ...]
) -> None:
    """Values differ by less than rounding of their size, wherever they were computed."""
    problem = swept(name, **driver)
    known = {n: v for n, v in problem.mechanism.parameters.items() if isinstance(v, float)}
    chosen = [n for n in names or known if n in known]
    sets = drawn(problem, chosen, share, 4)
    first = md.solve(problem, "turn")
    paths = tuple(f"summary/{path}" for path in outputs if known_path(first, path))
    assert len(paths) > 2
    found = Computer(problem, "turn", paths, tuple(chosen))(sets)
    assert found.together >= 3
    for k, values in enumerate(sets.tolist()):
        alone = row_of(problem, "turn", paths, dict(zip(chosen, values, strict=True)))
        assert found.status[k] == alone.status
        for path, column, other in zip(paths, found.values, alone.values, strict=True):
            right = np.full(column[k].shape, np.nan) if other is None else other
            assert column[k] == pytest.approx(right, rel=1e-13, abs=1e-15, nan_ok=True), path


def known_path(result: md.Result, path: str) -> bool:
    try:
        result.value(f"summary/{path}")
    except md.MechdaeError:
        return False
    return True


def test_a_quantity_that_rests_is_solved_alone() -> None:
    """A double pivot with the crank's length on the ground: coupler and rocker may stand still."""
    problem = swept("four-bar-crank-rocker")
    sets = np.array([[0.04, 0.12, 0.08, 0.1], [0.1, 0.12, 0.1, 0.12], [np.nan, 0.12, 0.08, 0.1]])
    path = "summary/extremes/coupler.angle/max/value"
    found = Computer(problem, "turn", (path,), tuple("abcd"))(sets)
    alone = [row_of(problem, "turn", (path,), dict(zip("abcd", row, strict=True)))
             for row in sets.tolist()]  # fmt: skip
    assert found.together == 1
    assert found.status == [row.status for row in alone]
    assert list(found.faults) == [2]
    right = [np.nan if row.values is None or row.values[0] is None else float(row.values[0])
             for row in alone]  # fmt: skip
    assert found.values[0] == pytest.approx(right, rel=1e-13, abs=1e-15, nan_ok=True)
