"""Kernels in C and JavaScript against Python at random poses, with limits and other numbers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.shared.c_kernels import Kernel, Rows, needs_gcc, walked
from tests.shared.exports import motion
from tests.shared.node import needs_node, run_script

SAMPLE = ("four-bar-crank-rocker", "gorshkov-seven-link", "rssr")
EQUAL = 1e-13
TWENTY = (
    ("gorshkov-seven-link", None, 0.3), ("jansen-leg", None, 0.3), ("watt-six-bar", None, 0.3),
    ("geared-five-bar", None, 0.3), ("slider-crank", None, 0.3), ("klann-leg", None, 0.3),
    ("triad-six-modes", None, 0.3), ("toggle-press", None, 0.3), ("belt-drive", None, 0.3),
    ("spur-gears-idler", None, 0.3), ("differential", None, 0.3), ("rssr", None, 0.3),
    ("rssp", None, 0.3), ("cardan-joint", None, 0.3), ("bevel-differential", None, 0.3),
    ("pantograph", "circle", 0.3), ("five-bar-robot", "forward", 0.3), ("delta-robot", None, 0.1),
    ("hexapod", "inverse", 0.05), ("hexapod", "forward", 0.05),
)  # fmt: skip
"""Mechanisms of plane and space, of one driver and several; how far they are moved about."""
FAST = (("four-bar-crank-rocker", None, 0.3), ("five-bar-robot", "circle", 0.3))
LONG = ("forward", 0.05)
"""A kernel of a million characters, which sanitizers take minutes to compile."""


def places(name: str) -> Any:
    run = motion(name).run
    low, high = float(min(run.places)), float(max(run.places))
    if motion(name).result.summary.get("limits", (None,))[0] is not None:
        low, high = 0.98 * low + 0.02 * high, 0.98 * high + 0.02 * low  # rates grow at limits
    return np.sort(np.random.default_rng(3).uniform(low, high, 200))


def ours(name: str, s: Any) -> list[Any]:
    """Return y, y', y'' (200, ny) by the driver."""
    run = motion(name).run
    poses = run.evaluator.at(run.path, s)
    assert poses.alive.all()
    assert not poses.uncertain.any()
    return poses.y[:3]


def agree(found: Any, known: list[Any]) -> None:
    for order, (one, other) in enumerate(zip(found, known, strict=True)):
        assert np.abs(one - other).max() <= EQUAL * np.abs(other).max(), order


@needs_gcc
@pytest.mark.parametrize(
    ("name", "task", "length"),
    [*FAST, *(pytest.param(*case, marks=pytest.mark.slow) for case in TWENTY)],
)
def test_c_agrees_at_random_poses(
    name: str, task: str | None, length: float, tmp_path: Path
) -> None:
    """Outputs, rates, derivatives by the drivers, bounds and codes of a walk in Python."""
    walk = walked(name, task, 50, length)
    kernel = Kernel(name, task, tmp_path, sanitized=(task, length) != LONG)
    found, known = kernel.rows(walk.u, walk.du, walk.ddu), walk.rows
    assert found.codes == known.codes
    proved = np.array(found.codes) == 0
    assert proved.sum() > 30
    ours, theirs = ([*rows.y, rows.jacobian] for rows in (found, known))
    agree([part[proved] for part in ours], [part[proved] for part in theirs])
    off = np.abs(found.y[0] - known.y[0])[proved]
    assert (off <= 2 * found.error[proved]).all()
    assert found.error[proved].max() <= 1e3 * max(known.error[proved].max(initial=0), 1e-15)
    # sizes that bounds hold for are those of the whole task, or of one pose
    assert (np.abs(np.log2(found.condition / known.condition))[proved] < 2).all()
    assert np.isnan([part[~proved] for part in found.y]).all()
    assert (found.share[~proved] < 1).all()


def moved(kernel: Kernel, s: Any, theta: list[float] | None = None) -> Rows:
    """Return poses of one driver with derivatives by its value."""
    return kernel.rows(np.array(s), np.ones(len(s)), np.zeros(len(s)), theta)


@needs_gcc
def test_c_stops_at_a_limit_position(tmp_path: Path) -> None:
    low, high = motion("gorshkov-seven-link").result.summary["limits"]
    kernel = Kernel("gorshkov-seven-link", None, tmp_path)
    near = [high - 1e-3, high + 1e-3, low + 1e-3, np.nan, low + 2e-3]
    rows = moved(kernel, near)
    assert rows.codes == [0, 1, 0, 2, 0]
    assert 0.4 < rows.share[1] < 0.6  # the limit is in the middle of that way
    s = places("gorshkov-seven-link")
    rows = moved(kernel, s)
    assert set(rows.codes) == {0}
    agree(rows.y, ours("gorshkov-seven-link", s))


@needs_gcc
def test_c_with_other_numbers(tmp_path: Path) -> None:
    name = "four-bar-crank-rocker"
    kernel = Kernel(name, None, tmp_path)
    theta, changed = other_numbers(name)
    rows = moved(kernel, [0.3, 1.0, 2.5, 5.0], theta)
    assert (kernel.set, set(rows.codes)) == (0, {0})
    agree(rows.y[:1], [columns(name, changed, [0.3, 1.0, 2.5, 5.0])])
    theta = [100.0 if own == changed["b"] else own for own in theta]  # it does not assemble
    rows = moved(kernel, places(name), theta)
    assert (kernel.set, set(rows.codes)) == (1, {0})
    agree(rows.y, ours(name, places(name)))
    moved(kernel, [0.3], [np.nan] * len(theta))
    assert kernel.set == 2


def other_numbers(name: str) -> tuple[list[float], dict[str, float]]:
    """Return inputs with two lengths changed, in the order of the header, and by name."""
    header = md.export(name, format="c").text.split("outputs y")[0]
    given = re.findall(r"^ \*\s+\d+\s+(\S+) \[[^]]*\] = (\S+)$", header, re.M)
    values = {word: float(value) for word, value in given}
    lengths = [word for word in ("b", "c") if word in values]
    assert len(lengths) == 2
    changed = {lengths[0]: 1.05 * values[lengths[0]], lengths[1]: 0.97 * values[lengths[1]]}
    return list((values | changed).values()), changed


def columns(name: str, changed: dict[str, float], s: Any) -> Any:
    """Return all outputs (n, ny) that Python finds with other numbers."""
    own = motion(name)
    driver = next(iter(own.result.drivers))
    task = md.Sweep(driver=md.Driver(driver, at=tuple(s)))
    result = md.solve(own.problem.with_values(changed), task)
    found = np.full((len(s), own.setting.graphs.outputs.numel()), np.nan)
    for entry in own.setting.outputs.entries:
        if entry.kind in ("bodies", "points", "joints") and entry.name != "guide":
            values = np.asarray(getattr(result, entry.kind)[entry.part][entry.name])
            found[:, list(entry.columns)] = values.reshape(len(s), -1)
    assert np.isfinite(found).all()
    return found


@needs_node
@pytest.mark.parametrize("name", SAMPLE)
def test_javascript_agrees_at_200_poses(name: str, tmp_path: Path) -> None:
    md.export(name, format="js").save(tmp_path / "kernel.mjs")
    s = places(name)
    text = (
        'import { Mechanism, info } from "./kernel.mjs";\n'
        f"const m = new Mechanism(), s = {s.tolist()};\n"
        "console.log(JSON.stringify([info, s.map((v) => { const { status, y, dy, ddy } = m.pose(v);"
        " return [status, y, dy, ddy]; })]));\n"
    )
    info, poses = run_script(text, tmp_path)
    assert {pose[0] for pose in poses} == {"ok"}
    agree([np.array([pose[k] for pose in poses]) for k in (1, 2, 3)], ours(name, s))
    assert info["driver"]["name"] == next(iter(motion(name).result.drivers))


@needs_node
def test_javascript_of_several_drivers(tmp_path: Path) -> None:
    """As in Python; what is refused leaves the pose, numbers may change, bounds hold."""
    walk = walked("five-bar-robot", "circle", 50)
    md.export("five-bar-robot", format="js", task="circle").save(tmp_path / "kernel.mjs")
    given = [part.tolist() for part in (walk.u, walk.du, walk.ddu)]
    text = (
        'import { Mechanism, info } from "./kernel.mjs";\n'
        f"const m = new Mechanism(), [u, du, ddu] = {given};\n"
        "const poses = u.map((v, k) => [m.pose(v, du[k], ddu[k]), m.jacobian()]);\n"
        "const out = m.pose([0.1, 5]), wild = m.pose([NaN, 0]);\n"
        "const back = m.pose(u[49], du[49], ddu[49]);\n"
        "const set = [m.set({ b: 0.31 }), m.set({ b: 0.3 }), m.set({ b: 9 }), m.pose(u[49]).y];\n"
        "console.log(JSON.stringify([info, poses, [out, wild, back], set]));\n"
    )
    info, poses, (out, wild, back), [there, here, far, same] = run_script(text, tmp_path)
    assert [driver["name"] for driver in info["drivers"]] == ["tip.P.x", "tip.P.y"]
    assert {pose["status"] for pose, _ in poses} == {"ok"}
    found = [[pose[key] for pose, _ in poses] for key in ("y", "dy", "ddy")]
    jacobians = [jacobian for _, jacobian in poses]
    agree([np.array(part) for part in [*found, jacobians]], [*walk.rows.y, walk.rows.jacobian])
    assert 0 < max(pose["bound"]["length"] for pose, _ in poses) < 1e-12
    assert (out["status"], wild["status"], out["y"]) == ("unassembled", "unassembled", None)
    assert 0 < out["share"] < 1
    assert back["y"] == pytest.approx(poses[49][0]["y"], abs=1e-14)
    assert (there, here, far) == (True, True, False)
    assert same == pytest.approx(back["y"], abs=1e-13)


@needs_node
def test_javascript_with_other_numbers_and_rates_in_time(tmp_path: Path) -> None:
    name = "four-bar-crank-rocker"
    md.export(name, format="js").save(tmp_path / "kernel.mjs")
    _, changed = other_numbers(name)
    s = [0.3, 1.0, 2.5, 5.0]
    text = (
        'import { Mechanism } from "./kernel.mjs";\n'
        f"const m = new Mechanism(), done = m.set({changed});\n"
        f"const poses = {s}.map((v) => m.pose(v, 3, 2));\n"
        "const far = m.set({ b: 1000 });\n"
        "console.log(JSON.stringify([done, far, poses.map(({ values }) => values),"
        " m.pose(0.3).y[0] === poses[0].y[0]]));\n"
    )
    done, far, values, same = run_script(text, tmp_path)
    assert (done, far, same) == (True, False, True)
    task = md.Sweep(driver=md.Driver("crank.angle", at=tuple(s), speed=3.0, acceleration=2.0))
    result = md.solve(motion(name).problem.with_values(changed), task)
    for k, own in enumerate(values):
        rocker = result.bodies["rocker"]
        assert own["bodies/rocker/angle"] == pytest.approx(rocker.angle[k], abs=1e-13)
        speed, acceleration = rocker.angular_velocity[k], rocker.angular_acceleration[k]
        assert own["bodies/rocker/angular_velocity"] == pytest.approx(speed, rel=1e-12)
        assert own["bodies/rocker/angular_acceleration"] == pytest.approx(acceleration, rel=1e-11)


def test_headers_say_inputs_outputs_units() -> None:
    for form in ("c", "js"):
        head = md.export("slider-crank", format=form).text.split("*/")[0]
        assert "driver s: crank.angle [rad]" in head
        assert re.search(r"\d  r \[m\] = 0\.1", head)
        assert re.search(r"\d+  points/rod\.C/position\[1\] \[m\]", head)
        assert re.search(r"\d+  joints/guide/slide \[m\]", head)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("cam-roller-follower", "no kernel of this task: its curves touch"),
        ("pendulum", "no kernel of this task: no driver is moved by its value"),
        ("bennett", "it has redundant equations"),
    ],
)
def test_what_is_no_kernel_is_refused(name: str, words: str) -> None:
    with pytest.raises(md.InputError, match=words):
        md.export(name, format="c")
