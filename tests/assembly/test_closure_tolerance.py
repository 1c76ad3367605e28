"""Dimensions of overconstrained mechanisms that hardly agree: a tolerance that is asked for."""

from __future__ import annotations

import json
import math
import re
import tomllib

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.writing import dumps
from mechdae.errors import AssemblyError, InputError, MechdaeError, UnavailableError
from tests.shared.noisy import bound_missed, parallelogram, value_named

FULL = md.Sweep(md.Driver("c1.angle", from_=0, to=2 * math.pi), poses=13)
AT = md.Sweep(md.Driver("c1.angle", at=[1.0]))


def locked(off: float) -> md.Mechanism:
    """Return a parallelogram with a third crank that closes where the cranks stand at 1 rad."""
    exact = parallelogram(0.0)
    shift = {"ground.A3.x": 1.0 - off * math.cos(1.0), "ground.A3.y": 0.7 - off * math.sin(1.0)}
    return exact.with_values({"c3.B.x": 1.0 + off, **shift})


@pytest.mark.parametrize("seed", range(12))
def test_poses_are_those_of_least_squares_within_their_bounds(seed: int) -> None:
    assert bound_missed(seed) < 1


@pytest.mark.parametrize("seed", range(6))
def test_the_value_that_is_named_does(seed: int) -> None:
    noise = 10.0 ** -np.random.default_rng(seed).uniform(5, 10)
    mechanism = parallelogram(noise, seed)
    with pytest.raises(AssemblyError, match="redundant and must be met exactly") as caught:
        md.solve(mechanism, AT)
    result = md.solve(mechanism.with_values({"closure_tolerance": value_named(caught.value)}), AT)
    assert list(result.status) == ["ok"]


def test_a_motion_that_is_locked_names_a_value_that_does() -> None:
    mechanism = locked(1e-9)
    result = md.solve(mechanism, FULL)
    assert "redundant equations hold there, but no further" in result.fault
    enough = max(entry["closure_tolerance"] for entry in result.summary["failed"])
    assert f"closure_tolerance = {enough:g}" in result.fault
    assert enough <= 1e-7
    freed = md.solve(mechanism.with_values({"closure_tolerance": enough}), FULL)
    assert set(freed.status) == {"ok"}
    assert freed.fault is None
    assert 1e-10 < freed.summary["closure"]["length"] < 1e-8
    assert f"redundant equations close within {enough:g} m" in str(freed.summary["assumptions"])


def test_what_is_no_noise_is_told_no_value() -> None:
    with pytest.raises(AssemblyError) as caught:
        md.solve(parallelogram(0.0).with_values({"c3.B.x": 1.01}), AT)
    assert "closure_tolerance" not in str(caught.value)


def test_without_the_key_nothing_changes_and_nought_is_no_key() -> None:
    with pytest.raises(AssemblyError):
        md.solve(parallelogram(1e-9).with_values({"closure_tolerance": 0.0}), AT)
    exact = md.solve(parallelogram(0.0), FULL)
    assert "closure" not in str(exact.summary["assumptions"])
    allowed = md.solve(parallelogram(0.0).with_values({"closure_tolerance": 1e-9}), FULL)
    assert np.array_equal(allowed.bodies["c3"].angle, exact.bodies["c3"].angle)
    assert np.all(allowed.bound.length > exact.bound.length)


def doubled_coupler(off: float, tolerance: float) -> md.Mechanism:
    bodies = [
        md.Body("crank", {"A": (0, 0), "B": (2, 0)}),
        md.Body("coupler", {"B": (0, 0), "C": (3, 0)}),
        md.Body("again", {"B": (0, 0), "C": (3 + off, 0)}),
        md.Body("rocker", {"D": (0, 0), "C": (1.5, 0)}),
    ]
    pins = {
        "A": ("ground.A", "crank.A"), "B": ("crank.B", "coupler.B"), "E": ("crank.B", "again.B"),
        "C": ("coupler.C", "rocker.C"), "F": ("again.C", "rocker.C"), "D": ("ground.D", "rocker.D"),
    }  # fmt: skip
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (4, 0)}),
        bodies=bodies,
        joints=[md.Revolute(name, *ends) for name, ends in pins.items()],
        sketch={"crank": 1.0, "coupler": 0.0, "again": 0.0, "rocker": 1.0},
        closure_tolerance=tolerance,
    )


def test_limits_lie_between_those_of_either_length() -> None:
    """Stretched: |BD| = coupler + rocker, the crank's angle by the law of cosines."""
    off = 1e-7
    sweep = md.Sweep(md.Driver("crank.angle", range="assembled"), poses=5)
    result = md.solve(doubled_coupler(off, 1e-6), sweep)
    assert set(result.status) == {"ok", "limit"}
    least, most = (math.acos((16 + 4 - (length + 1.5) ** 2) / 16) for length in (3.0, 3.0 + off))
    for end in map(abs, result.summary["limits"]):
        assert least + 0.2 * off < end < most - 0.2 * off


def test_modes_are_found_but_not_proven() -> None:
    modes = md.solve(doubled_coupler(1e-7, 1e-6), md.Modes(md.Driver("crank.angle", at=[1.0])))
    assert modes.summary["count"] == 2
    assert not modes.summary["proven"]
    assert "close within 1e-06 m" in modes.summary["assumptions"][0]


def test_axes_of_a_drawing_program() -> None:
    """A planar four-bar in space: three equations more than it needs, axes off by 1e-12 rad."""
    points = {"A": (0, 0, 0), "B": (1, 0, 0.1), "C": (4, 1.5, 0.2), "D": (4, 0, 0)}
    ends = [("A", "ground", "crank"), ("B", "crank", "coupler"), ("C", "coupler", "rocker"),
            ("D", "rocker", "ground")]  # fmt: skip
    draw = np.random.default_rng(4)
    joints = [
        md.SpatialRevolute(
            name, f"{a}.{name}", f"{b}.{name}", axis=(*draw.normal(size=2) * 1e-12, 1.0)
        )
        for name, a, b in ends
    ]
    held = {name: [p for p, *own in ends if name in own] for name in ("crank", "coupler", "rocker")}
    mechanism = md.Mechanism(
        dimension=3, frames="drawn",
        ground=md.Ground({name: points[name] for name in "AD"}),
        bodies=[md.Body(name, {p: points[p] for p in own}) for name, own in held.items()],
        joints=joints,
    )  # fmt: skip
    sweep = md.Sweep(md.Driver("A.angle", from_=-0.5, to=0.5), poses=3)
    strict = md.solve(mechanism, sweep)
    assert "closure_tolerance" in strict.fault
    assert "ok" in strict.status
    result = md.solve(mechanism.with_values({"closure_tolerance": 1e-10}), sweep)
    assert set(result.status) == {"ok"}


TEXT = """schema = 1
{key}
[ground]
points = {{ A = [0, 0] }}
[bodies.crank]
points = {{ A = [0, 0] }}
[joints]
A = {{ kind = "revolute", between = ["ground.A", "crank.A"] }}
[parameters]
tol_mm = 0.5
"""


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("closure_tolerance = 1e-9", 1e-9),
        ("closure_tolerance_mm = 2", 0.002),
        ("closure_tolerance_m = 2", 2.0),
        ('closure_tolerance = "2*tol"', 0.001),
        ("", 0.0),
    ],
)
def test_the_key_has_units_and_comes_back(key: str, value: float, tmp_path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(TEXT.format(key=key))
    problem = md.load(path)
    again = from_dict(tomllib.loads(dumps(problem)))
    for one in (problem, again):
        assert one.mechanism.tolerance == pytest.approx(value, rel=1e-15)
    assert problem.with_values({"closure_tolerance_mm": 3}).mechanism.tolerance == 0.003


@pytest.mark.parametrize(
    ("key", "word"),
    [
        ("closure_tolerance = -1", "closure_tolerance: is negative"),
        ("closure_tolerance_deg = 1", "'_deg' does not fit"),
        ("closure_tolerance = [1]", "a number or an expression is needed"),
        ("closure_tolerence = 1", "did you mean closure_tolerance"),
        ("closure_tolerance = 1\nclosure_tolerance_mm = 1", "given twice"),
        ("parameters.closure_tolerance = 1", "reserved"),
    ],
)
def test_bad_keys_are_told(key: str, word: str, tmp_path) -> None:
    path = tmp_path / "a.toml"
    text = TEXT.replace("\n[parameters]\ntol_mm = 0.5", "")
    path.write_text(text.format(key=key))
    with pytest.raises(MechdaeError, match=re.escape(word)):
        md.load(path)


def test_a_set_value_has_a_unit_of_length() -> None:
    with pytest.raises(InputError, match="does not fit"):
        parallelogram(0.0).with_values({"closure_tolerance_deg": 1})


def test_certificates_say_that_they_close_exactly() -> None:
    from mechdae.parts.proof.write import certificate_of

    loose = parallelogram(0.0).with_values({"closure_tolerance": 1e-6, "c3.B.x": 1 + 1e-7})
    with pytest.raises(UnavailableError, match="not met exactly"):
        certificate_of(md.Problem(loose, {"turn": FULL}), "turn")


def test_json_has_the_tolerance_of_lost_poses() -> None:
    shown = json.loads(json.dumps(md.solve(locked(1e-9), FULL).to_dict()))
    assert shown["summary"]["failed"][0]["closure_tolerance"] <= 1e-7
