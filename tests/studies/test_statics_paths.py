"""Studies and sensitivities of equilibria and motions, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.dynamics.rest import implicit
from mechdae.errors import InputError, UnknownName
from tests.attack import equilibria
from tests.shared.block import X0, C, K, M, block, course


def slope(function: Any, at: float, step: float = 1e-3) -> float:
    """Return a derivative of a closed form: central differences to order six."""
    values = [function(at * (1 + k * step)) for k in (-3, -2, -1, 1, 2, 3)]
    weights = np.array([-1, 9, -45, 45, -9, 1]) / 60
    return float(weights @ np.array(values)) / (at * step)


def test_study_of_an_equilibrium_and_of_a_motion() -> None:
    paths = ["summary/frequencies/0", "summary/settling_time", "bodies/block/angle", "x"]
    study = {"kind": "study", "of": "rest", "vary": {"k": [40, 60, 3]}, "outputs": paths}
    result = md.solve(block(study=study), "study")
    for row, k in enumerate((40.0, 50.0, 60.0)):
        w = math.sqrt(k / M - (C / (2 * M)) ** 2) / (2 * math.pi)
        assert result.table["summary/frequencies/0"][row] == pytest.approx(w, rel=1e-12)
        settled = math.log(50) * 2 * M / C
        assert result.table["summary/settling_time"][row] == pytest.approx(settled, rel=1e-12)
        assert result.table["x"][row, 0] == pytest.approx(-M * 9.81 * math.sin(0.3) / k, rel=1e-12)
    assert result.path_unit("summary/settling_time") == "s"

    paths = ["last/x", "highest/x", "lowest/x", "peak/x/rate", "settling/x"]
    study = {"kind": "study", "of": "go", "vary": {"k": [40, 60, 3]}, "outputs": paths}
    result = md.solve(block(study=study), "study")
    fine = np.linspace(0, 3, 3_000_001)
    for row, k in enumerate((40.0, 50.0, 60.0)):
        x = course(fine, M, k, C, X0)
        table = {path: float(values[row]) for path, values in result.table.items()}
        assert table["last/x"] == pytest.approx(x[-1], rel=1e-9)
        assert table["highest/x"] == pytest.approx(X0, rel=1e-12)
        assert table["lowest/x"] == pytest.approx(x.min(), rel=1e-9)
        speed = np.abs(np.gradient(x, fine)).max()
        assert table["peak/x/rate"] == pytest.approx(speed, rel=1e-8)
        far = np.abs(x - x[-1])
        settled = fine[np.flatnonzero(far > 0.02 * far.max())[-1]]
        assert table["settling/x"] == pytest.approx(settled, abs=2e-6)
    for path, error in result.summary["estimated_error"].items():
        assert error < 1e-6, path


def test_derivatives_of_an_equilibrium() -> None:
    names = ("k", "m", "c")
    paths = ("x", "points/block.P/position", "summary/frequencies", "summary/damping/0",
             "summary/settling_time", "summary/modes/0/eigenvalue")  # fmt: skip
    task = md.Sensitivity(of="rest", outputs=paths, wrt=names)
    result = md.solve(block(), task)
    assert result.summary["differenced"] == []
    found = result.data["derivatives"]
    values = {"m": M, "k": K, "c": C}

    def frequency(m: float, k: float, c: float) -> float:
        return math.sqrt(k / m - (c / (2 * m)) ** 2) / (2 * math.pi)

    forms = {
        "outputs/x/value": lambda m, k, c: -m * 9.81 * math.sin(0.3) / k,
        "summary/frequencies": frequency,
        "summary/damping/0": lambda m, k, c: c / (2 * math.sqrt(k * m)),
        "summary/settling_time": lambda m, k, c: math.log(50) * 2 * m / c,
    }
    for path, form in forms.items():
        for name in names:
            wanted = slope(
                lambda v, form=form, name=name: form(**(values | {name: v})), values[name]
            )
            got = float(np.ravel(found[path][name])[0])
            assert got == pytest.approx(wanted, rel=1e-9, abs=1e-12), (path, name)
    along = found["points/block.P/position"]["k"][0]
    x = M * 9.81 * math.sin(0.3) / K**2
    assert along == pytest.approx([x * math.cos(0.3), x * math.sin(0.3)], rel=1e-12)
    assert found["summary/modes/0/eigenvalue"]["c"][0] == pytest.approx(-1 / (2 * M), rel=1e-12)


@pytest.mark.parametrize("seed", [2, 5, 12])
def test_derivatives_of_a_four_bar_at_rest(seed: int) -> None:
    """dtheta/dk = -E_theta,k / E_theta,theta on the branch, by a closed form of its own."""
    case, generator = equilibria.drawn(seed)
    data = case.data(generator)
    data["tasks"]["rest"]["linearise"] = False
    task = md.Sensitivity(of="rest", outputs=("bodies/crank/angle",), wrt=("loads.pull.stiffness",))
    problem = from_dict(data)
    result = md.solve(problem, task)
    theta = float(result.data["values"]["bodies/crank/angle"][0])
    k = case.k

    def pull(stiffness: float) -> float:
        case.k = stiffness
        found = case.slope(theta)
        case.k = k
        return found

    mixed = slope(pull, k)
    steps = [(case.slope(theta + h) - case.slope(theta - h)) / (2 * h) for h in (1e-3, 5e-4)]
    stiff = (4 * steps[1] - steps[0]) / 3
    got = float(result.data["derivatives"]["bodies/crank/angle"]["loads.pull.stiffness"][0])
    assert got == pytest.approx(-mixed / stiff, rel=1e-7)
    assert result.summary["implicit"] == ["bodies/crank/angle"]


def test_frequencies_of_a_linkage_against_differences() -> None:
    """The pose moves the frequency too: without that part of the derivative the test fails."""
    problem = md.load("double-pendulum")
    task = md.Equilibrium(linearise=True, drivers=(md.Driver("upper.angle", at=[0.7]),))
    case, generator = equilibria.drawn(5)
    data = case.data(generator)
    data["tasks"]["rest"]["linearise"] = True
    problem = from_dict(data)
    name = "loads.pull.stiffness"
    base = problem.mechanism.values()[name]

    def frequency(k: float) -> float:
        result = md.solve(problem.with_values({name: k}), "rest")
        return float(result.summary["modes"][0]["natural_frequency"])

    wanted = slope(frequency, base)
    paths = ("summary/modes/0/natural_frequency",)
    task = md.Sensitivity(of="rest", outputs=paths, wrt=(name,))
    got = float(md.solve(problem, task).data["derivatives"][paths[0]][name])
    assert got == pytest.approx(wanted, rel=1e-8)


def test_a_pose_that_stays_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: frequencies differentiated as if the pose did not move."""
    zero = property(lambda self: np.zeros((self.whole.kernel.n + self.whole.kernel.m, 1)))
    monkeypatch.setattr(implicit.Implicit, "slopes", zero)
    with pytest.raises(AssertionError):
        test_frequencies_of_a_linkage_against_differences()


def test_derivatives_of_a_motion() -> None:
    """End state, extremes and settling time; differences carry an estimate that holds."""
    paths = ("last/x", "lowest/x", "summary/state/x/0")
    task = md.Sensitivity(of="go", outputs=paths, wrt=("k", "x0"))
    result = md.solve(block(), task)
    values = {"m": M, "k": K, "c": C, "x0": X0}
    fine = np.linspace(0, 3, 300_001)
    forms = {
        "last/x": lambda **p: float(course(3.0, **p)),
        "summary/state/x/0": lambda **p: float(course(3.0, **p)),
    }
    assert float(course(fine, **values).min()) == pytest.approx(
        float(result.data["values"]["lowest/x"]), rel=1e-7
    )
    for path, form in forms.items():
        for name in ("k", "x0"):
            wanted = slope(
                lambda v, form=form, name=name: form(**(values | {name: v})), values[name]
            )
            got = float(result.data["derivatives"][path][name])
            error = float(result.data["estimated_error"][path][name])
            assert got == pytest.approx(wanted, rel=1e-8), (path, name)
            assert abs(got - wanted) <= 10 * error + 1e-10 * abs(wanted)


def test_mistakes_are_told() -> None:
    study = {"kind": "study", "of": "rest", "vary": {"k": [40, 60, 3]}, "outputs": ["last/x"]}
    with pytest.raises(InputError, match="has no time history"):
        md.solve(block(study=study), "study")
    study = {"kind": "study", "of": "rset", "vary": {"k": [40, 60, 3]}, "outputs": ["x"]}
    with pytest.raises(UnknownName, match="rset"):
        md.solve(block(study=study), "study")
    with pytest.raises(InputError, match="say which task"):
        md.solve(block(), md.Sensitivity(outputs=("x",), wrt=("k",)))
    with pytest.raises(UnknownName, match="frequncies"):
        md.solve(block(), md.Sensitivity(of="rest", outputs=("summary/frequncies",), wrt=("k",)))
