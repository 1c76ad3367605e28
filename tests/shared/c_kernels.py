"""Exported kernels in C, compiled with all warnings and the sanitizers, run on rows of poses."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.kinematics.tracker import Tracker
from mechdae.parts.page import page_drivers as ways
from mechdae.types import Floats
from tests.shared.exports import motion

GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="no gcc")
STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror")
SANITIZED = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
MAIN = """\
#include <stdio.h>
#include "kernel.h"
static int read(double *to, int count) {
  int i;
  for (i = 0; i < count; i++) if (scanf("%lf", to + i) != 1) return 0;
  return 1;
}
static void write(const double *from, int count) {
  int i;
  for (i = 0; i < count; i++) printf(" %.17g", from[i]);
}
int main(void) {
  static NAME m;
  static double y[3][NAME_N_Y], error[NAME_N_Y], jacobian[NAME_N_Y * NAME_N_U];
  double u[3][NAME_N_U], theta[NAME_N_THETA + 1];
  int k, code;
  if (NAME_bytes() != (int) sizeof m || NAME_start(&m)) return 3;
  if (scanf("%d", &code) != 1) return 4;
  if (code) {
    if (!read(theta, NAME_N_THETA)) return 4;
    printf("%d\\n", NAME_set(&m, theta));
  }
  while (read(u[0], 3 * NAME_N_U)) {
    printf("%d", NAME_track(&m, u[0], u[1], u[2], y[0], y[1], y[2]));
    NAME_jacobian(&m, jacobian);
    NAME_error(&m, error);
    for (k = 0; k < 3; k++) write(y[k], NAME_N_Y);
    write(error, NAME_N_Y);
    write(jacobian, NAME_N_Y * NAME_N_U);
    write(&m.condition, 1);
    write(&m.share, 1);
    printf("\\n");
  }
  return 0;
}
"""


class Rows(NamedTuple):
    """Poses: codes (n,), outputs by order (n, ny), bounds, derivatives (n, ny, nu), conditions."""

    codes: list[int]
    y: list[Floats]
    error: Floats
    jacobian: Floats
    condition: Floats
    share: Floats


class Kernel:
    """The compiled kernel of a task in a folder."""

    def __init__(self, name: str, task: str | None, folder: Path, sanitized: bool = True) -> None:
        """Write, compile and keep it; with all warnings as errors."""
        md.export(name, format="c", task=task).save(folder / "kernel.c")
        (folder / "main.c").write_text(MAIN.replace("NAME", re.sub(r"\W", "_", name)))
        assert GCC is not None
        words = [
            GCC,
            *STRICT,
            *(SANITIZED if sanitized else ()),
            "kernel.c",
            "main.c",
            "-o",
            "main",
            "-lm",
        ]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        self.program = folder / "main"

    def rows(self, u: Floats, du: Floats, ddu: Floats, theta: list[float] | None = None) -> Rows:
        """Return the poses at drivers' values (n, nu) with rates, one after the other."""
        given = np.hstack([np.reshape(part, (len(u), -1)) for part in (u, du, ddu)])
        numbers = "0" if theta is None else " ".join(["1", *map(repr, theta)])
        words = "\n".join([numbers, *(" ".join(map(repr, row)) for row in given.tolist())])
        command = [str(self.program)]
        done = subprocess.run(command, input=words, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        lines = done.stdout.splitlines()
        self.set = 0 if theta is None else int(lines.pop(0))
        table = np.array([[float(word) for word in line.split()] for line in lines])
        nu = given.shape[1] // 3
        ny = (table.shape[1] - 3) // (4 + nu)
        codes, *y, error, jacobian, condition, share = np.split(
            table, [1, *(1 + ny * k for k in (1, 2, 3, 4)), 1 + ny * (4 + nu), -1], axis=1
        )
        return Rows(
            codes[:, 0].astype(int).tolist(),
            y,
            error,
            jacobian.reshape(len(table), ny, nu),
            condition[:, 0],
            share[:, 0],
        )


class Walk(NamedTuple):
    """Values and rates of drivers (n, nu), and what Python has there."""

    u: Floats
    du: Floats
    ddu: Floats
    rows: Rows


def walked(name: str, task: str | None, count: int, length: float = 0.3) -> Walk:
    """Return a walk at random from the first pose of a task, followed by a tracker of Python."""
    setting, run = motion(name, task).setting, motion(name, task).run
    assert setting is not None
    assert run is not None
    random = np.random.default_rng(11)
    s, x = ways.start_of(run.path)
    here = run.path.drivers(np.array([s]))[0]
    tracker = Tracker(setting, here, x)
    sizes = setting.driver_sizes
    shape = (count, len(here))
    u = np.zeros(shape)
    du, ddu = (sizes * random.normal(size=shape) for _ in range(2))
    node, found, begin = tracker.first, [], here
    for k in range(count):
        u[k] = begin + length * sizes * random.uniform(-1, 1, len(here))
        rates = [du[k], ddu[k], 0 * here][: len(tracker.usual)]
        pose = tracker.to(node, u[k], rates)
        found.append(pose)
        node = pose.node if pose.node is not None and pose.ok[0] else node
    slopes = [np.stack([s[0] for s in pose._slopes()], axis=1) for pose in found]
    rows = Rows(
        [0 if pose.ok[0] else 1 for pose in found],
        [np.vstack([pose._y[k] for pose in found]) for k in range(3)],
        np.vstack([pose.error for pose in found]),
        np.array(slopes),
        np.concatenate([pose.condition for pose in found]),
        np.ones(count),
    )
    return Walk(u, du, ddu, rows)
