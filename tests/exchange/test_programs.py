"""Kernels in C and JavaScript against Python at 200 poses, and with other numbers."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.shared.exports import motion
from tests.shared.node import needs_node, run_script

GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="no gcc")
SAMPLE = ("four-bar-crank-rocker", "gorshkov-seven-link", "rssr")
EQUAL = 1e-13
MAIN = """\
#include <stdio.h>
#include "kernel.c"
int main(void) {
  static NAME m;
  double y[3][NAME_N_Y], s, theta[NAME_N_THETA + 1];
  int i, k, code;
  if (NAME_start(&m)) return 3;
  if (scanf("%d", &code) != 1) return 4;
  if (code) {
    for (i = 0; i < NAME_N_THETA; i++) if (scanf("%lf", &theta[i]) != 1) return 4;
    code = NAME_set(&m, theta);
    printf("%d\\n", code);
  }
  while (scanf("%lf", &s) == 1) {
    code = NAME_pose(&m, s, y[0], y[1], y[2]);
    printf("%d", code);
    for (k = 0; k < 3; k++) for (i = 0; i < NAME_N_Y; i++) printf(" %.17g", y[k][i]);
    printf("\\n");
  }
  return 0;
}
"""


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


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a function that compiles the kernel of a problem, once."""
    made: dict[str, Path] = {}

    def build(name: str) -> Path:
        if name not in made:
            folder = tmp_path_factory.mktemp("c")
            md.exported(name, "c").save(folder / "kernel.c")
            text = MAIN.replace("NAME", re.sub(r"\W", "_", name))
            (folder / "main.c").write_text(text)
            words = ["-std=c99", "-pedantic", "-Wall", "-Werror", "-O1", "main.c", "-o", "main"]
            done = subprocess.run(
                [GCC, *words, "-lm"], cwd=folder, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, done.stderr
            made[name] = folder / "main"
        return made[name]

    return build


def run_c(program: Path, s: Any, theta: Any = None) -> tuple[int, list[int], list[Any]]:
    """Return the code of the new numbers, those of the poses, and y, y', y''."""
    numbers = [0] if theta is None else [1, *theta]
    words = "\n".join(repr(float(v)) if k else str(v) for k, v in enumerate([*numbers, *s]))
    done = subprocess.run([str(program)], input=words, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    code = 0 if theta is None else int(lines.pop(0))
    table = np.array([[float(word) for word in line.split()] for line in lines])
    codes = table[:, 0].astype(int).tolist()
    return code, codes, np.split(table[:, 1:], 3, axis=1)


@needs_gcc
@pytest.mark.parametrize("name", SAMPLE)
def test_c_agrees_at_200_poses(name: str, program: Any) -> None:
    s = places(name)
    _, codes, found = run_c(program(name), s)
    assert set(codes) == {0}
    agree(found, ours(name, s))


@needs_gcc
def test_c_stops_at_a_limit_position(program: Any) -> None:
    low, high = motion("gorshkov-seven-link").result.summary["limits"]
    _, codes, _ = run_c(program("gorshkov-seven-link"), [high - 1e-3, high + 1e-3, low + 1e-3])
    assert codes == [0, 1, 0]


@needs_gcc
def test_c_with_other_numbers(program: Any) -> None:
    name = "four-bar-crank-rocker"
    theta, changed = other_numbers(name)
    code, codes, found = run_c(program(name), [0.3, 1.0, 2.5, 5.0], theta)
    assert (code, set(codes)) == (0, {0})
    agree(found[:1], [columns(name, changed, [0.3, 1.0, 2.5, 5.0])])
    theta = [100.0 if own == changed["b"] else own for own in theta]  # it does not assemble
    code, codes, found = run_c(program(name), places(name), theta)
    assert (code, set(codes)) == (1, {0})
    agree(found, ours(name, places(name)))


def other_numbers(name: str) -> tuple[list[float], dict[str, float]]:
    """Return inputs with two lengths changed, in the order of the header, and by name."""
    header = md.exported(name, "c").text.split("outputs y")[0]
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
    md.exported(name, "js").save(tmp_path / "kernel.mjs")
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
def test_javascript_with_other_numbers_and_rates_in_time(tmp_path: Path) -> None:
    name = "four-bar-crank-rocker"
    md.exported(name, "js").save(tmp_path / "kernel.mjs")
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
        head = md.exported("slider-crank", form).text.split("*/")[0]
        assert "driver s: crank.angle [rad]" in head
        assert re.search(r"\d  r \[m\] = 0\.1", head)
        assert re.search(r"\d+  points/rod\.C/position\[1\] \[m\]", head)
        assert re.search(r"\d+  joints/guide/slide \[m\]", head)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("cam-roller-follower", "no kernel of this task: its curves touch"),
        ("pendulum", "a kernel is made of a task with one driver"),
        ("bennett", "it has superfluous equations"),
        ("five-bar-robot", "one driver"),
        ("spur-gears-idler", "nothing is left to be solved"),
    ],
)
def test_what_is_no_kernel_is_refused(name: str, words: str) -> None:
    with pytest.raises(md.InputError, match=words):
        md.exported(name, "c")
