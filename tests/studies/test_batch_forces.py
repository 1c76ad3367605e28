"""Forces of many sets at once: free bodies, and what each set gives alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.design.studies.rows import Computer, row_of
from tests.reference.force_truth import circle
from tests.reference.force_truth import slider_crank as free_slider_crank
from tests.shared.force_cases import INERTIA, S1, slider_crank

JOINTS = ("O", "B", "C", "slide")
REL = 1e-12


def cycle(mechanism: md.Mechanism, poses: int = 25, **keys: Any) -> md.Problem:
    driver = md.Driver("crank.angle", from_=0.0, to=2 * np.pi, speed=keys.pop("speed", 40.0))
    return md.Problem(mechanism, {"forces": md.Reactions(driver, poses=poses, **keys)})


def together(problem: md.Problem, sets: dict[str, Any], outputs: tuple[str, ...]) -> Any:
    table = np.stack([np.asarray(own, float) for own in sets.values()], axis=1)
    return Computer(problem, "forces", outputs, tuple(sets))(table)


def alone(problem: md.Problem, sets: dict[str, Any], outputs: tuple[str, ...]) -> list[Any]:
    rows = zip(*sets.values(), strict=True)
    values = [dict(zip(sets, map(float, row), strict=True)) for row in rows]
    return [row_of(problem, "forces", outputs, own) for own in values]


def compare(found: Any, rows: list[Any], outputs: tuple[str, ...]) -> None:
    """Statuses, faults and missing values are the same, numbers to their rounding."""
    assert found.status == [str(row.status) for row in rows]
    assert [found.faults.get(k, "") for k in range(len(rows))] == [row.fault for row in rows]
    for j, path in enumerate(outputs):
        for own, row in zip(found.values[j], rows, strict=True):
            right = np.full(own.shape, np.nan) if row.values is None else row.values[j]
            size = np.nanmax(np.abs(right), initial=0.0)
            assert own == pytest.approx(right, rel=REL, abs=REL * size, nan_ok=True), path


def drawn(names: tuple[str, ...], share: float, count: int) -> dict[str, Any]:
    rng, base = np.random.default_rng(8), {**S1, **INERTIA}
    return {n: base[n] * (1 + share * rng.uniform(-1, 1, count)) for n in names}


def test_a_slider_crank_against_free_bodies() -> None:
    """Friction in four joints that acts on the reactions it comes from, inertia, both strokes."""
    names = ("r", "l", "f", "f_slide", "m_slider", "m_rod", "Q_work")
    sets = drawn(names, 0.3, 12)
    problem = cycle(slider_crank(inertia=True))
    outputs = (
        "efforts/crank.angle", "efforts_uncoupled/crank.angle",
        *(f"joints/{name}/reaction" for name in JOINTS),
        *(f"joints/{name}/loss" for name in JOINTS), "bodies/rod/angular_velocity",
    )  # fmt: skip
    found = together(problem, sets, outputs)
    assert found.together == 12
    assert set(found.status) == {"ok"}
    value = dict(zip(outputs, found.values, strict=True))
    theta = np.linspace(0, 2 * np.pi, 25)
    inner = np.abs(np.sin(theta)) > 1e-9  # at dead centres the free bodies have no sign of speed
    for k in range(12):
        own = {name: float(column[k]) for name, column in sets.items()}
        rho = tuple(circle(S1[f"r_{name}"], own["f"]) for name in "OBC")
        scene, motion = free_slider_crank(
            theta, 40.0, own["r"], own["l"],
            lambda v, work=own["Q_work"]: np.where(v < 0, work, -S1["Q_return"]),
            rho, own["f_slide"], m_rod=own["m_rod"], I_rod=INERTIA["I_rod"],
            c_rod=INERTIA["c_rod"], m_slider=own["m_slider"],
        )  # fmt: skip
        truth, free = scene.solve(), scene.solve(friction=False)
        pairs = [
            (value["efforts/crank.angle"], truth["T"]),
            (value["efforts_uncoupled/crank.angle"], free["T"]),
            (value["bodies/rod/angular_velocity"], motion["rod"].c[1]),
        ]
        pairs += [(value[f"joints/{name}/reaction"], truth.reaction(name)) for name in JOINTS]
        pairs += [(value[f"joints/{name}/loss"], truth.loss(name)) for name in JOINTS]
        for ours, right in pairs:
            gap = np.abs(ours[k] - np.asarray(right))[inner]
            assert gap.max() <= 1e-12 * np.abs(np.asarray(right)[inner]).max()


@pytest.mark.parametrize("friction", ["coupled", "article", "none"])
def test_rows_are_those_of_the_sets_alone(friction: str) -> None:
    """Poses at dead centres, a spring, a table and gravity; a set that locks, one without pose."""
    mechanism = slider_crank(inertia=True, gravity=(0.0, -9.81))
    loads = [
        *mechanism.loads.values(),
        md.Spring("spring", coordinate="slide.slide", stiffness=200.0, free_length=0.2),
    ]
    problem = cycle(replace(mechanism, loads=loads), friction=friction)
    sets = drawn(("r", "l", "f", "f_slide", "c_rod"), 0.2, 8)
    sets["r"][2], sets["l"][4], sets["r"][6] = 0.35, 0.02, 0.0
    outputs = (
        "efforts/crank.angle", "joints/B/reaction", "joints/slide/normal",
        "joints/slide/slide_acceleration", *(["joints/slide/loss"] * (friction != "none")),
    )  # fmt: skip
    found = together(problem, sets, outputs)
    assert found.together >= 5
    compare(found, alone(problem, sets, outputs), outputs)


def test_sets_that_jam_say_where_and_by_which_joint() -> None:
    """Without other friction the guide jams at tan(beta) > 1 / f, first with the crank across."""
    mechanism = slider_crank(Q_work=1000, Q_return=1000, f=0.0)
    problem = cycle(mechanism, poses=13, speed=10.0)
    sets = {"f_slide": [0.4, 0.5, 0.48], "l": [1 / 9] * 3}
    outputs = ("efforts/crank.angle", "joints/slide/reaction")
    found = together(problem, sets, outputs)
    assert found.together == 3
    compare(found, alone(problem, sets, outputs), outputs)
    assert found.status == ["ok", "jammed", "ok"]
    critical = np.sqrt((1 / 9) ** 2 - 0.1**2) / 0.1
    first = float(found.faults[1].split("jams from ")[1].split()[0])
    assert first == pytest.approx(critical / 0.5, rel=1e-5)
    assert "first at crank.angle = 90 deg" in found.faults[1]
    assert found.faults[1].endswith("by joint slide")
    across = np.isnan(found.values[0][1])
    assert np.flatnonzero(across).tolist() == [3, 9]


def test_a_study_reports_what_is_wrong_with_each_set() -> None:
    problem = cycle(slider_crank(f=0.0), poses=13, speed=10.0)
    samples = {"f_slide": [0.1, 0.5, float("nan"), 0.1], "l": [1 / 9, 1 / 9, 0.3, 0.0]}
    path = "efforts/crank.angle"
    result = md.study(problem, sets=samples, of="forces", outputs=[path])
    assert [str(word) for word in result.status] == ["ok", "jammed", "unassembled", "unassembled"]
    assert [entry["set"] for entry in result.summary["faults"]] == [1, 2, 3]
    assert np.isfinite(result.table[path]).all(axis=1).tolist() == [True, False, False, False]


def test_forces_are_not_screened() -> None:
    problem = cycle(slider_crank(), poses=9)
    asked = {"sets": {"r": [0.1, 0.11]}, "of": "forces", "outputs": ["efforts/crank.angle"]}
    screened = md.study(problem, certify=False, **asked)
    assert screened.summary["certified"] is True
    assert "forces are not screened" in screened.summary["notes"][0]
    assert np.array_equal(
        screened.table["efforts/crank.angle"],
        md.study(problem, **asked).table["efforts/crank.angle"],
    )
