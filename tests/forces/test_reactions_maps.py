"""Studies of cycles: efficiency over one and two parameters, and what a task does not build."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.shared.force_cases import S1, slider_crank

# constant load, friction in the guide alone, crank drives: published values for both rods
STROKE = {
    1 / 3: (
        (0.05, 0.98632337478812, 0.98650790116718, 0.98630688417877),
        (0.1, 0.97264674957624, 0.97337502907351, 0.97258015427395),
        (0.2, 0.94529349915247, 0.94813106698066, 0.94502187353813),
        (0.4, 0.89058699830495, 0.9013775739712, 0.88945534970675),
    ),
    0.9: (
        (0.05, 0.93839710635327, 0.94197181072565, 0.93750415699252),
        (0.1, 0.87679421270654, 0.89030880299295, 0.87298061988572),
        (0.2, 0.75358842541308, 0.80230320416546, 0.73580600843911),
        (0.4, 0.50717685082615, 0.66987171290411, 0.38935309866868),
    ),
}


def problem() -> md.Problem:
    """Return the slider-crank of the reference with a study of its cycle."""
    mechanism = slider_crank(Q_work=1000, Q_return=1000)
    driver = md.Driver("crank.angle", from_=0, to=2 * np.pi, speed=10)
    cycle = md.Reactions(driver, poses=13, cycle=True)
    return md.Problem(mechanism, Table({"cycle": cycle}))


def test_efficiency_over_friction_and_length() -> None:
    """A map of two parameters: three efficiencies, each as published."""
    names = ("efficiency_formula_10", "efficiency_uncoupled", "efficiency")
    task = md.Study(
        samples={
            "f": [0.0] * 8,
            "f_slide": [row[0] for rows in STROKE.values() for row in rows],
            "l": [S1["r"] / ratio for ratio, rows in STROKE.items() for _ in rows],
        },
        of="cycle",
        outputs=tuple(f"summary/{name}" for name in names),
    )
    result = md.solve(problem(), task)
    assert set(result.status) == {"ok"}
    expected = np.array([row[1:] for rows in STROKE.values() for row in rows])
    for k, name in enumerate(names):
        assert result.table[f"summary/{name}"] == pytest.approx(expected[:, k], rel=1e-9)


def test_a_set_that_jams_says_so() -> None:
    """Above f = 0.4843 the guide of the short rod jams: no efficiency, the others stay."""
    task = md.Study(
        vary={"f_slide": ["0.4", "0.5", 2], "l": [1 / 9, 1 / 9, 1], "f": [0, 0, 1]},
        of="cycle",
        outputs=("summary/efficiency", "summary/efficiency_formula_10", "summary/jammed_arcs"),
    )
    result = md.solve(problem(), task)
    assert list(result.status) == ["ok", "jammed"]
    values = result.table["summary/efficiency"]
    assert np.isfinite(values[0])
    assert np.isnan(values[1])


def test_a_set_that_jams_between_its_poses_says_so() -> None:
    """It jams where the rod leans most, at 90 degrees; the poses are at 83 and 111 degrees."""
    task = md.Study(
        samples={"f_slide": [0.484, 0.485], "l": [1 / 9] * 2, "f": [0.0] * 2},
        of="cycle",
        outputs=("summary/efficiency",),
    )
    plain = problem()
    cycle = replace(plain.tasks["cycle"], poses=14)
    result = md.solve(replace(plain, tasks=Table({"cycle": cycle})), task)
    assert list(result.status) == ["ok", "jammed"]
    assert np.isfinite(result.table["summary/efficiency"]).tolist() == [True, False]


def test_critical_factor_of_a_mechanism_that_does_not_jam() -> None:
    """f_crit = cot(beta_max): the rod leans most with the crank across."""
    task = md.Reactions(md.Driver("crank.angle", at=[0.3, np.pi / 2, 2.0], speed=10))
    mechanism = slider_crank().with_values({"f": 0.0, "f_slide": 0.1, "l": 1 / 9})
    found = md.solve(mechanism, task).summary["critical_factor"]
    assert found["factor"] == pytest.approx(0.484322104837853 / 0.1, rel=1e-5)
    assert found["at"] == np.pi / 2
    assert found["joint"] == "slide"


# -- only what a scene needs -----------------------------------------------------------------------


def test_a_kinematic_task_builds_no_forces(monkeypatch) -> None:
    from mechdae.equations.forces import friction, generalised, loads
    from mechdae.kernels.graphs import kinetostatics

    def refuse(*_args, **_keys):
        raise AssertionError("built for a kinematic task")

    for home, name in (
        (kinetostatics.Balance, "__init__"),
        (loads.Loads, "__init__"),
        (friction.Laws, "__init__"),
        (generalised, "inertia"),
        (md.Mechanism, "center") if hasattr(md.Mechanism, "center") else (generalised, "massive"),
    ):
        monkeypatch.setattr(home, name, refuse)
    driver = md.Driver("crank.angle", from_=0, to=1)
    result = md.solve("slider-crank-inertia", md.Sweep(driver, poses=3))
    assert list(result.status) == ["ok"] * 3


def test_without_friction_no_friction_is_built() -> None:
    """No law, no sign, no size: and a task without friction leaves those of the file out."""
    from mechdae.forces import inverse_dynamics

    built: list = []
    original = inverse_dynamics.InverseDynamics.__init__

    def note(self, *arguments, **keys):
        original(self, *arguments, **keys)
        built.append(self.balance)

    driver = md.Driver("crank.angle", from_=0, to=1, speed=10)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(inverse_dynamics.InverseDynamics, "__init__", note)
        plain = md.solve(slider_crank(), md.Reactions(driver, poses=3, friction="none"))
        rough = md.solve(slider_crank(), md.Reactions(driver, poses=3))
    assert [len(kinetostatics.feedbacks) for kinetostatics in built] == [0, 4]
    assert [slip.owner for slip in built[0].slips] == ["work"]
    assert built[0].report().n_instructions() < built[1].report().n_instructions()
    assert "loss" not in plain.joints["O"]
    assert "loss" in rough.joints["O"]
    assert "efforts_uncoupled" not in plain.to_dict()
