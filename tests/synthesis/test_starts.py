"""Starts of syntheses: as many as are asked for, alike in any size and on any frame."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.load import from_dict
from mechdae.design.synthesis.fourbar import linkage
from mechdae.design.synthesis.fourbar.starts import FourBarStarts
from mechdae.design.synthesis.search import Search
from mechdae.design.synthesis.synthesize import planned, synthesize
from mechdae.numerics.null_space import linear_fit
from tests.reference.closure_fourbar import FourBar, judged
from tests.shared.frames import FRAMES, goals, on_frame
from tests.shared.paths import DATA, ROOT

GOALS = list(goals(1.0))
SIZES = (2.0**-20, 2.0**10)
"""Of mechanisms of some micrometres, and of some hundred metres; powers of two change no bits."""
FILES = DATA / "synthesis"


def drawn(problem: md.Problem, count: int = 12, seed: int = 0) -> list[tuple[np.ndarray, list]]:
    """Return by class the designs (n, nd) that a search starts from, over sizes, and ranks."""
    task = problem.tasks["design"]
    search = Search(problem, task)
    by_class = planned(search, [search.build(kind) for kind in search.kinds], count, seed)
    units = parameter_units(problem.mechanism, problem.tasks.values())
    size = np.array([problem.mechanism.scale if units.get(name) == "m" else 1.0
                     for name in search.asked.free])  # fmt: skip
    return [
        (np.array([start.values["d"] for start in own]) / size, [s.residual for s in own])
        for own in by_class
    ]


@pytest.mark.parametrize("goal", GOALS)
@pytest.mark.parametrize("frame", FRAMES)
def test_there_are_as_many_starts_as_are_asked_for(frame: str, goal: str) -> None:
    """Of each of Grashof's classes; and the same of a mechanism of another size."""
    found = drawn(on_frame(frame, goal))
    assert [len(d) for d, _ in found] == [12] * len(found)
    for size in SIZES if frame == "pivots" else ():
        other = drawn(on_frame(frame, goal, size))
        for (d, ranks), (own, own_ranks) in zip(found, other, strict=True):
            np.testing.assert_allclose(own, d, rtol=1e-6, atol=1e-7)
            np.testing.assert_allclose(own_ranks, ranks, rtol=1e-6)


@pytest.mark.parametrize("goal", [word for word in GOALS if word.startswith("path")])
def test_starts_on_two_free_pivots_are_those_on_a_welded_frame(goal: str) -> None:
    """Up to what the bounds of both say: the best of them fit as well."""
    by_frame = {frame: drawn(on_frame(frame, goal)) for frame in ("weld", "pivots", "polygons")}
    for k in range(2):
        best = {
            frame: np.median([rank for rank in own[k][1] if np.isfinite(rank)])
            for frame, own in by_frame.items()
        }
        assert best["polygons"] == best["pivots"] <= 1.05 * best["weld"]


def test_the_best_path_is_found_with_both_pivots_as_coordinates() -> None:
    """As with a welded frame: 60 starts, the best of which misses by 1.626e-6 m^2."""
    problem = md.load(FILES / "path-pivots-as-coordinates.toml")
    task = problem.tasks["design"]
    found = synthesize(problem, "design", task)
    assert found.summary["starts"] == 60
    best = found.data["designs"][0]
    assert abs(best["objective"] / 1.62617e-6 - 1) < 1e-4
    p = best["parameters"]
    ground = complex(p["dx"] - p["ax"], p["dy"] - p["ay"])
    own = FourBar(
        (abs(ground), p["r2"], p["r3"], p["r4"]), complex(p["px"], p["py"]), p["ax"], p["ay"],
        float(np.angle(ground)),
    )  # fmt: skip
    at = np.array(best["at"]) - np.angle(ground)
    verdict = judged(own, at, np.array(task.goal.targets))
    assert abs(np.sum(verdict.errors**2) / best["objective"] - 1) < 1e-6
    assert not verdict.defects


def scaled(name: str, size: float) -> md.Problem:
    """Return a predefined problem of synthesis, its lengths multiplied."""
    text = (ROOT / "problems" / f"{name}.toml").read_text(encoding="utf-8")
    units = parameter_units(from_dict(tomllib.loads(text)).mechanism, ())
    raw = tomllib.loads(text)
    raw.pop("expected", None)

    def large(value):
        if isinstance(value, list):
            return [large(own) for own in value]
        return value if isinstance(value, str) else value * size

    for part in [raw["ground"], *raw["bodies"].values()]:
        part["points"] = {key: large(place) for key, place in part["points"].items()}
    for table in (raw["parameters"], raw["tasks"]["design"]["free"]):
        table |= {key: large(table[key]) for key in table if units.get(key) == "m"}
    raw["sketch"] = {
        key: large(value) if isinstance(value, list) else value
        for key, value in raw["sketch"].items()
    }
    goal = raw["tasks"]["design"]["goal"]
    goal["targets"] = large(goal["targets"])
    return from_dict(raw)


@pytest.mark.parametrize("name", ["gear5-g1", "rssr-path", "rssp-path"])
def test_starts_of_any_mechanism_are_alike_in_any_size(name: str) -> None:
    """A geared five-bar that is shifted, turned and enlarged, and loops in space."""
    found = drawn(scaled(name, 1.0))
    assert [len(d) for d, _ in found] == [12]
    for size in SIZES:
        for (d, ranks), (own, own_ranks) in zip(found, drawn(scaled(name, size)), strict=True):
            np.testing.assert_allclose(own, d, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(own_ranks, ranks, rtol=1e-9)


def test_a_damped_fit_is_the_same_in_other_units() -> None:
    """Columns of metres beside columns without a unit, by the normal equations in long double."""
    rng = np.random.default_rng(3)
    A, b = rng.normal(size=(4, 9, 3)), rng.normal(size=(4, 9))
    plain = linear_fit(A, b, ridge=1e-3)
    for size in SIZES:
        mixed = A * np.array([1.0, size, size])
        found = linear_fit(mixed, b * size, ridge=1e-3, sizes=np.array([size, 1.0, 1.0]))
        np.testing.assert_array_equal(found / np.array([size, 1.0, 1.0]), plain)
    N = np.einsum("nki,nkj->nij", A, A)
    N += 1e-3 * np.trace(N, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    np.testing.assert_allclose(
        plain, np.linalg.solve(N, np.einsum("nki,nk->ni", A, b)[..., None])[..., 0], rtol=1e-12
    )


# -- planted mistakes ----------------------------------------------------------------------------


def test_bounds_from_two_corners_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both ends of the box have both pivots at one place: a ground of length zero."""

    def two(own: FourBarStarts) -> np.ndarray:
        ends = own.space.lengths(own.space.box.T)[0]
        return np.stack([ends.min(axis=0), ends.max(axis=0)], axis=1)

    monkeypatch.setattr(FourBarStarts, "limits", two)
    with pytest.raises(AssertionError):
        test_starts_on_two_free_pivots_are_those_on_a_welded_frame("path in order")


def test_a_ridge_in_metres_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    from mechdae.design.synthesis.starts import similar

    def in_metres(A, b, ridge=0.0, least=0.0, sizes=1.0):
        return linear_fit(A, b, ridge, least)

    monkeypatch.setattr(similar, "linear_fit", in_metres)
    with pytest.raises(AssertionError):
        test_starts_of_any_mechanism_are_alike_in_any_size("gear5-g1")


def test_lengths_of_zero_rank_nothing_as_infinite(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fixed ground of length zero is no reason to drop all samples, nor for a warning."""
    targets = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    limits = np.array([[0.0, 0.0], [0.1, 5.0], [0.1, 5.0], [0.1, 5.0]])
    generator = np.random.default_rng(0)
    found = linkage.screened(
        targets, generator, 2000, 5, "crank-rocker", None, "free", None, limits
    )
    assert len(found) == 5
