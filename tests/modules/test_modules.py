"""Vector modules: reference solutions of 60 digits, planted data, data near folds."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.motion.modules.catalogue import MODULES, PLANE, WORDS
from mechdae.motion.modules.solutions import ModuleSolutions, solve_module
from tests.shared.paths import DATA

TABLE = json.loads((DATA / "vector_modules.json").read_text(encoding="utf-8"))
USABLE = [name for name, module in MODULES.items() if not module.singular]
PLANAR = {"l alpha of one vector": "la", "l, l": "l-l", "l, alpha": "l-a", "alpha, alpha": "a-a"}


def solve_planar(name: str, vectors: list[dict[str, Any]], total: list[float]) -> ModuleSolutions:
    """Return all real solutions of a planar module: vectors with `length` and `angle`.

    A planar module is a spatial one whose vectors lie in a plane of one azimuth, beside a third
    vector at right angles to it, which vanishes.
    """
    d = np.atleast_2d(np.asarray(total, float))
    level = np.zeros(len(d))
    total3 = np.stack([d[:, 0], d[:, 1], level], axis=1)
    solutions = [
        {"elevation" if word == "angle" else word: value for word, value in v.items()}
        | {"azimuth": level}
        for v in vectors
    ]
    # the line across, along z: its length is found as zero
    across = {"elevation": level, "azimuth": level + np.pi / 2}
    spatial, order = {
        "la": ("la-l", [*solutions, across]),
        "l-l": ("l-l-l", [*solutions, across]),
        "l-a": ("l-l-a", [solutions[0], across, *solutions[1:]]),
        "a-a": ("l-a-a", [across, *solutions]),
    }[name]
    result = solve_module(spatial, order, total3)
    unknowns = {}
    for key, value in result.unknowns.items():
        word, place = key[:-1], int(key[-1]) - 1
        given = order[place]
        if given is across:
            continue
        position = next(k for k, v in enumerate(solutions, start=1) if v is given)
        unknowns[f"{'angle' if word == 'elevation' else word}{position}"] = value
    return ModuleSolutions(
        dict(sorted(unknowns.items())), result.count, result.gap, result.determinant
    )


def vector(length: Any, elevation: Any, azimuth: Any) -> Any:
    level = length * np.cos(elevation)
    parts = (level * np.cos(azimuth), length * np.sin(elevation), level * np.sin(azimuth))
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def apart(found: ModuleSolutions, k: int, wanted: dict[str, str], row: int = 0) -> float:
    """Return how far a solution is from one of the table, angles over whole turns."""
    worst = 0.0
    for name, text in wanted.items():
        gap = found.unknowns[name][row, k] - float(text)
        if not name.startswith("length"):
            gap = np.angle(np.exp(1j * gap))
        worst = max(worst, abs(gap))
    return worst


def compare(found: ModuleSolutions, row: dict[str, Any]) -> None:
    assert found.count[0] == row["count_real"]
    for solution in row["solutions"]:
        wanted = {name: text for name, text in solution.items() if name != "det"}
        k = min(range(found.count[0]), key=lambda k: apart(found, k, wanted))
        assert apart(found, k, wanted) < 1e-13
        if "det" in solution:
            assert abs(found.determinant[0, k]) == pytest.approx(float(solution["det"]), rel=1e-6)


@pytest.mark.parametrize("name", USABLE)
def test_spatial_modules_against_the_table(name: str) -> None:
    for row in TABLE["spatial"][name]["rows"]:
        known = [{word: float(x) for word, x in own.items()} for own in row["vectors"]]
        compare(solve_module(name, known, [float(x) for x in row["sum"]]), row)
        assert row["count_complex"] <= MODULES[name].solutions


@pytest.mark.parametrize("name", PLANAR)
def test_planar_modules_against_the_table(name: str) -> None:
    for row in TABLE["planar"][name]:
        known = [{word: float(x) for word, x in own.items()} for own in row["vectors"]]
        compare(solve_planar(PLANAR[name], known, [float(x) for x in row["sum"]]), row)


def drawn(name: str, count: int, seed: int) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return full vectors at random, and what of them is known."""
    rng = np.random.default_rng(seed)
    full = [
        {
            "length": rng.uniform(0.3, 2.0, count),
            "elevation": rng.uniform(-1.4, 1.4, count),
            "azimuth": rng.uniform(-np.pi, np.pi, count),
        }
        for _ in MODULES[name].unknowns
    ]
    known = [
        {word: own[word] for letter, word in WORDS.items() if letter not in letters}
        for letters, own in zip(MODULES[name].unknowns, full, strict=True)
    ]
    return full, known


def places(name: str, known: list[dict[str, Any]], found: ModuleSolutions) -> Any:
    """Return the vectors (n, k, 3 m) of all solutions."""
    parts = []
    for position, own in enumerate(known, start=1):
        values = {
            word: found.unknowns.get(f"{word}{position}", None)
            if f"{word}{position}" in found.unknowns
            else own[word][:, None]
            for word in WORDS.values()
        }
        parts.append(vector(**values))
    return np.concatenate(np.broadcast_arrays(*parts), axis=-1)


def lost(name: str, known: list[dict[str, Any]], found: ModuleSolutions, planted: Any) -> int:
    """Return how many planted solutions (n, 3 m) are not among those found."""
    every = places(name, known, found)
    gaps = np.linalg.norm(every - planted[:, None], axis=-1)
    nearest = np.where(np.isfinite(gaps), gaps, np.inf).min(axis=1)
    return int((nearest > 1e-7 * np.linalg.norm(planted, axis=1)).sum())


@pytest.mark.parametrize("name", USABLE)
def test_planted_solutions_are_found(name: str) -> None:
    full, known = drawn(name, 1000, 11)
    values = [vector(**own) for own in full]
    total = np.sum(values, axis=0)
    found = solve_module(name, known, total)
    assert lost(name, known, found, np.concatenate(values, axis=-1)) == 0
    assert found.count.max() <= MODULES[name].solutions
    every = places(name, known, found)
    closure = every.reshape(*every.shape[:2], -1, 3).sum(axis=2) - total[:, None]
    sizes = np.linalg.norm(every, axis=-1)
    assert np.nanmax(np.linalg.norm(closure, axis=-1) / sizes) <= 1e-13


def jacobian(name: str, full: list[dict[str, Any]]) -> Any:
    """Return the derivatives (n, 3, 3) of the sum by the unknowns, by central differences."""
    columns, step = [], 1e-6
    for position, letters in enumerate(MODULES[name].unknowns):
        for letter in letters:
            sides = []
            for sign in (1, -1):
                own = dict(full[position])
                own[WORDS[letter]] = own[WORDS[letter]] + sign * step
                sides.append(vector(**own))
            columns.append((sides[0] - sides[1]) / (2 * step))
    return np.stack(columns, axis=-1)


FOLDING = [name for name in USABLE if MODULES[name].solutions > 1]


@pytest.mark.parametrize("name", FOLDING)
@pytest.mark.parametrize("half", [1e-2, 1e-4, 1e-6])
def test_solutions_near_a_fold_are_found(name: str, half: float) -> None:
    """Move one unknown to where the determinant vanishes, then by `half` along its null vector."""
    full, known = drawn(name, 400, 5)
    spots = [(p, WORDS[c]) for p, own in enumerate(MODULES[name].unknowns) for c in own]
    position, word = next(
        spot for spot in reversed(spots) if spot[1] != "length"
    )  # the angle that is turned
    grid = np.linspace(-1.3, 1.3, 27) if word == "elevation" else np.linspace(-3, 3, 61)

    def det(value: Any) -> Any:
        return np.linalg.det(jacobian(name, [
            own | {word: value} if p == position else own for p, own in enumerate(full)
        ]))  # fmt: skip

    values = np.stack([det(np.full(400, x)) for x in grid])
    change = np.sign(values[1:]) != np.sign(values[:-1])
    rows = np.flatnonzero(change.any(axis=0))
    first = np.argmax(change, axis=0)
    low, high = grid[first], grid[first + 1]
    sign = np.sign(det(low))
    for _ in range(60):
        middle = (low + high) / 2
        same = np.sign(det(middle)) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    full[position] = full[position] | {word: low}
    null = np.linalg.svd(jacobian(name, full))[2][:, -1]
    for index, (p, w) in enumerate(spots):
        full[p] = full[p] | {w: full[p][w] + half * null[:, index]}
    known = [{w: full[p][w] for w in own} for p, own in enumerate(known)]
    pole = [np.abs(np.cos(own["elevation"])) > 0.05 for own in full]
    rows = rows[np.all(pole, axis=0)[rows]]
    full = [{w: x[rows] for w, x in own.items()} for own in full]
    known = [{w: x[rows] for w, x in own.items()} for own in known]
    assert rows.size > 20
    vectors = [vector(**own) for own in full]
    found = solve_module(name, known, np.sum(vectors, axis=0))
    every = places(name, known, found)
    gaps = np.linalg.norm(every - np.concatenate(vectors, axis=-1)[:, None], axis=-1)
    nearest = np.where(np.isfinite(gaps), gaps, np.inf).min(axis=1)
    # rounding moves solutions that are 2 half apart by about 1e-15 / half, near cusps by 1e-5
    assert (nearest < 1e-4).all()
    strict = nearest < 1e-8 + 1e-12 / half
    assert strict.mean() > 0.98
    own = strict
    partner = np.sort(np.where(np.isfinite(gaps), gaps, np.inf), axis=1)[own, 1]
    assert (partner < 20 * half).mean() > 0.95
    assert found.count.max() <= MODULES[name].solutions


def test_the_eight_of_three_elevations() -> None:
    """A datum whose eight solutions are all real."""
    known = [
        {"length": length, "azimuth": azimuth}
        for length, azimuth in zip((0.95, 0.94, 0.95), (-0.07, 2.02, 0.97), strict=True)
    ]
    found = solve_module("a-a-a", known, [-0.01, 0.89, -0.01])
    assert found.count[0] == 8
    assert sorted(found.labels(0)) == ["+", "+2", "+3", "+4", "-", "-2", "-3", "-4"]


def test_the_pair_of_a_two_circle_module_has_both_labels() -> None:
    found = solve_planar("a-a", [{"length": 3.0}, {"length": 4.0}], [5.0, 0.0])
    assert found.labels(0) == ["+", "-"]
    assert np.allclose(np.cos(found.unknowns["angle1"][0]), 0.6, rtol=1e-15)


def test_what_has_no_solution() -> None:
    assert solve_planar("a-a", [{"length": 1.0}, {"length": 1.0}], [3.0, 0.0]).count[0] == 0
    with pytest.raises(md.InputError, match="second row holds no unknown"):
        solve_module("b-b-b", [{}, {}, {}], [0, 0, 0])
    with pytest.raises(md.InputError, match="azimuth of vector 2 is missing"):
        solve_module("la-l", [{"azimuth": 1.0}, {"elevation": 0.2}], [0, 0, 1])
    with pytest.raises(md.UnknownName):
        solve_module("l-la", [], [0, 0, 1])


def test_catalogue(capsys: pytest.CaptureFixture[str]) -> None:
    """All multisets of unknowns with one, two and three vectors are there, each once."""
    from itertools import combinations_with_replacement as multisets

    pairs = {f"{a}{b}-{c}" for a, b in (("l", "a"), ("l", "b"), ("a", "b")) for c in "lab"}
    triples = {"-".join(own) for own in multisets("lab", 3)}
    assert set(MODULES) == {"lab"} | pairs | triples
    assert [module.number for module in MODULES.values()] == list(range(1, 21))
    assert set(PLANE) == {"la", "l-l", "l-a", "a-a"}
    assert main(["modules", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (len(data["planar"]), len(data["spatial"])) == (4, 20)
    assert [entry["name"] for entry in data["spatial"] if entry["singular"]] == ["b-b-b"]
    assert data["spatial"][5]["unknowns"] == [["length", "azimuth"], ["elevation"]]
    assert main(["modules"]) == 0
    text = capsys.readouterr().out
    assert "structurally singular" in text
    assert "\u03b1 | \u03b1 | \u03b2" in text
