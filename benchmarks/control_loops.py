"""Arms and platforms as arrays and in loops, beside solutions of their own in NumPy and in C.

``python -m benchmarks.control_loops --out docs/data/control-loops.json --page PAGE``
measures the five-bar robot, a delta robot, an excavator and a hexapod both ways, writes the
figures and the table. Seconds are processor time, medians of calls taken in turn; the closed forms
know no rates, bounds and limits. A pose that is far off its closed form, or refused with no limit
near, is counted.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import mechdae as md
from benchmarks.written import arguments, c_library, written

SOURCE = Path(__file__).with_name("control_loops.c")
EXCAVATOR = Path(__file__).parents[1] / "tests/data/excavator-massless-cylinders.toml"
BEGIN, END = "<!-- control loops -->", "<!-- end of control loops -->"
LOOP, JUMPS = 1000, 15_000
"""Calls of a loop of small moves, and of values far from each other."""
SIZES = {1: 200, 100: 60, 100_000: 3}
"""Poses of an array, and how often it is measured at most,"""
LONG = 20.0
"""of which no more is begun after so many seconds."""
WRONG, NEAR = 1e-9, 0.05
"""Distance from the closed form that is wrong; share of the largest margin that is near a limit."""
Rows = Any


# -- closed forms ---------------------------------------------------------------------------------


def meeting(A: Rows, a: Any, B: Rows, b: Any) -> tuple[Rows, Rows]:
    """Return where circles about A and B (n, 2) meet, left of the way, and their margin (n,).

    The margin is the sine of the angle between both radii; nan where they do not meet.
    """
    way = B - A
    far = np.hypot(*way.T)
    along = (a * a - b * b + far * far) / (2 * far)
    height = np.sqrt(a * a - along * along)
    across = np.stack([-way[:, 1], way[:, 0]], axis=1)
    place = A + (along / far)[:, None] * way + (height / far)[:, None] * across
    return place, height * far / (a * b)


def at(base: Rows, angle: Any, x: float, y: float) -> Rows:
    c, s = np.cos(angle), np.sin(angle)
    return base + np.stack([c * x - s * y, s * x + c * y], axis=1)


def angle(v: Rows) -> Any:
    return np.arctan2(v[:, 1], v[:, 0])


def five_bar_forward(u: Rows) -> tuple[Rows, Rows]:
    """Return the tip (n, 2) at the motors' angles."""
    zero = np.zeros((len(u), 2))
    return meeting(
        at(zero, u[:, 0], 0.2, 0), 0.3, at(zero + np.array([0.2, 0.0]), u[:, 1], 0.2, 0), 0.3
    )


def five_bar_inverse(u: Rows) -> tuple[Rows, Rows]:
    """Return the motors' angles (n, 2) at the tip."""
    zero, E = np.zeros((len(u), 2)), np.tile([0.2, 0.0], (len(u), 1))
    B, one = meeting(zero, 0.2, u, 0.3)
    D, other = meeting(u, 0.3, E, 0.2)
    return np.stack([angle(B), angle(D - E)], axis=1), np.minimum(one, other)


def delta_forward(u: Rows) -> tuple[Rows, Rows]:
    """Return the platform (n, 3) at the arms' angles: the lower meeting point of three spheres."""
    turns = np.radians([0.0, 120.0, 240.0])
    far = 0.2 + 0.25 * np.cos(u) - 0.06
    P = np.stack([far * np.cos(turns), far * np.sin(turns), -0.25 * np.sin(u)], axis=2)
    a, b = P[:, 1] - P[:, 0], P[:, 2] - P[:, 0]
    aa, bb, ab = (np.sum(x * y, axis=1) for x, y in ((a, a), (b, b), (a, b)))
    det = aa * bb - ab * ab
    v, q = (aa * bb - bb * ab) / (2 * det), (bb * aa - aa * ab) / (2 * det)
    m, w = v[:, None] * a + q[:, None] * b, np.cross(a, b)
    left = 0.6**2 - np.sum(m * m, axis=1)
    h = -np.sqrt(left / det) * np.sign(w[:, 2])
    return P[:, 0] + m + h[:, None] * w, np.sqrt(left) / 0.6


def excavator_forward(u: Rows) -> tuple[Rows, Rows]:
    """Return place and angle of the bucket (n, 3) at the cylinders' lengths."""
    base = np.zeros((len(u), 2))
    Kb, one = meeting(base, np.hypot(2.2, 0.5), base + np.array([0.6, -0.3]), u[:, 0])
    boom = angle(Kb) - np.arctan2(0.5, 2.2)
    A, Ca = at(base, boom, 5, 0), at(base, boom, 2, 0.9)
    Ka, two = meeting(Ca, u[:, 1], A, np.hypot(0.6, 0.15))
    arm = angle(Ka - A) - np.arctan2(0.15, -0.6)
    Cq, R, Q = at(A, arm, 0.3, 0.45), at(A, arm, 2.2, 0), at(A, arm, 2.6, 0)
    S, three = meeting(Cq, u[:, 2], R, 0.5)
    T, four = meeting(S, 0.62, Q, np.hypot(0.1368, 0.3759))
    bucket = turned(angle(T - Q) - np.arctan2(0.3759, -0.1368))
    W = at(Q, bucket, 1.3, 0)
    return np.column_stack([W, bucket]), np.minimum.reduce([one, two, three, four])


def excavator_inverse(u: Rows) -> tuple[Rows, Rows]:
    """Return the cylinders' lengths (n, 3) at the bucket's place and angle."""
    base = np.zeros((len(u), 2))
    Q = at(u[:, :2], u[:, 2], -1.3, 0)
    A, one = meeting(base, 5.0, Q, 2.6)
    boom, arm = angle(A), angle(Q - A)
    R = at(A, arm, 2.2, 0)
    S, two = meeting(R, 0.5, at(Q, u[:, 2], -0.1368, 0.3759), 0.62)
    ends = (
        (at(base, boom, 2.2, 0.5), base + np.array([0.6, -0.3])),
        (at(A, arm, -0.6, 0.15), at(base, boom, 2, 0.9)),
        (S, at(A, arm, 0.3, 0.45)),
    )
    return np.stack([np.hypot(*(p - q).T) for p, q in ends], axis=1), np.minimum(one, two)


def turned(a: Any) -> Any:
    return a - 2 * np.pi * np.round(a / (2 * np.pi))


FEET = 0.5 * np.exp(1j * np.radians([-10, 10, 110, 130, 230, 250]))
BALLS = 0.25 * np.exp(1j * np.radians([-50, 50, 70, 170, 190, 290]))


def hexapod_inverse(u: Rows) -> tuple[Rows, Rows]:
    """Return the legs (n, 6) at place, yaw, pitch and roll of the platform."""
    (cy, cp, cr), (sy, sp, sr) = np.cos(u[:, 3:].T), np.sin(u[:, 3:].T)
    x, y = BALLS.real, np.outer(cr, BALLS.imag)
    z = np.outer(sr, BALLS.imag)
    x, z = np.outer(cp, x) + sp[:, None] * z, cp[:, None] * z - np.outer(sp, x)
    dx = u[:, :1] + cy[:, None] * x - sy[:, None] * y - FEET.real
    dy = u[:, 1:2] + sy[:, None] * x + cy[:, None] * y - FEET.imag
    legs = np.sqrt(dx**2 + dy**2 + (u[:, 2:3] + z) ** 2)
    return legs, np.ones(len(u))


def hexapod_slopes(u: Rows) -> Rows:
    """Return the legs' derivatives (n, 6, 6) by the platform's coordinates, in differences."""
    h = 1e-6 * np.eye(6)
    return np.stack(
        [(hexapod_inverse(u + d)[0] - hexapod_inverse(u - d)[0]) / 2e-6 for d in h], axis=2
    )


def hexapod_forward(u: Rows) -> tuple[Rows, Rows]:
    """Return the platform (n, 6) at the legs' lengths, by Newton's method from the level pose."""
    x = np.tile([0.0, 0.0, 0.5, 0.0, 0.0, 0.0], (len(u), 1))
    for _ in range(12):
        J = hexapod_slopes(x)
        step = np.linalg.solve(J, (hexapod_inverse(x)[0] - u)[:, :, None])[:, :, 0]
        x = x - step
        if np.abs(step).max() < 1e-14:
            break
    least = np.linalg.svd(J, compute_uv=False)[:, -1]
    return x, np.where(np.abs(step).max(axis=1) < 1e-9, least, np.nan)


# -- cases ----------------------------------------------------------------------------------------


class Arm(NamedTuple):
    """A mechanism driven one way: what it is asked, drawn around `begin`, and its closed form.

    ``spread`` (nd,) is how far the values of arrays are from `begin`, ``jumps`` how many times
    as far those of calls at random.
    """

    name: str
    problem: Any
    task: Any
    paths: tuple[str, ...]
    begin: tuple[float, ...]
    spread: tuple[float, ...]
    form: Callable[[Rows], tuple[Rows, Rows]]
    jumps: float = 3.0

    @property
    def function(self) -> str:
        """Of the closed form in C."""
        return self.form.__name__


def swept(*names: str, at: tuple[float, ...]) -> md.Sweep:
    return md.Sweep(
        drivers=tuple(md.Driver(name, at=(v,)) for name, v in zip(names, at, strict=True))
    )


def arms() -> list[Arm]:
    """Return what is measured."""
    bucket = ("points/bucket.W/position", "bodies/bucket/angle")
    cylinders = tuple(f"joints/cyl{k}/slide" for k in (1, 2, 3))
    legs = tuple(f"joints/leg{k}/slide" for k in range(1, 7))
    place = ("x/slide", "y/slide", "z/slide", "yaw/angle", "pitch/angle", "roll/angle")
    held, level = (2.2, 3.35, 1.8), (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)
    posed = tuple(excavator_forward(np.array([held]))[0][0].tolist())
    leg = tuple(hexapod_inverse(np.array([level]))[0][0].tolist())
    inverse = swept("bucket.W.x", "bucket.W.y", "bucket.angle", at=posed)
    tip, motors = ("points/tip.P/position",), ("bodies/left/angle", "bodies/right/angle")
    robot = ("five-bar-robot", "five-bar-robot")
    return [
        Arm("five-bar robot, forward", robot[0], "forward", tip, (2.2, 0.9), (0.5, 0.5),
            five_bar_forward),
        Arm("five-bar robot, inverse", robot[1], "circle", motors, (0.1, 0.35), (0.06, 0.06),
            five_bar_inverse),
        Arm("delta robot, forward", "delta-robot", "path", ("points/platform.T/position",),
            (0.2, 0.2, 0.2), (0.3, 0.3, 0.3), delta_forward),
        Arm("excavator, forward", EXCAVATOR, "forward", bucket, held, (0.15, 0.08, 0.1),
            excavator_forward),
        Arm("excavator, inverse", EXCAVATOR, inverse, cylinders, posed, (0.4, 0.3, 0.2),
            excavator_inverse),
        Arm("hexapod, inverse", "hexapod", "inverse", legs, level,
            (0.03, 0.03, 0.03, 0.1, 0.1, 0.1), hexapod_inverse),
        Arm("hexapod, forward", "hexapod", "forward",
            tuple(f"joints/{p}" for p in place), leg, (0.02,) * 6, hexapod_forward),
    ]  # fmt: skip


def in_c(arm: Arm, count: int) -> Callable[[Rows], Rows] | None:
    """Return the closed form in C with so many outputs, None where there is none."""
    function = getattr(c_library(SOURCE), arm.function, None)
    if function is None:
        return None
    pointer = np.ctypeslib.ndpointer(float, flags="C_CONTIGUOUS")
    function.argtypes, function.restype = [ctypes.c_long, pointer, pointer], None

    def call(u: Rows) -> Rows:
        out = np.empty((len(u), count))
        function(len(u), u, out)
        return out

    return call


# -- measuring ------------------------------------------------------------------------------------


def outputs(arm: Arm, poses: Any) -> Rows:
    """Return what is read of poses, (n, m)."""
    return np.column_stack([poses[path] for path in arm.paths])


def drawn(arm: Arm, count: int, seed: int, wide: float = 1.0) -> Rows:
    random = np.random.default_rng(seed)
    spread = wide * np.array(arm.spread) * random.uniform(-1, 1, (count, len(arm.begin)))
    return np.ascontiguousarray(np.array(arm.begin) + spread)


def timed(calls: dict[str, Callable[[], Any]], count: int) -> dict[str, float]:
    """Return the median seconds of calls, each after the other, again and again."""
    spent: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()
    for _ in range(count):
        for name, call in calls.items():
            begun = time.process_time()
            call()
            spent[name].append(time.process_time() - begun)
        if sum(spent["mechdae"]) > LONG:
            break
    return {name: float(np.median(each)) for name, each in spent.items()}


def off(arm: Arm, found: Rows, u: Rows) -> Rows:
    """Return how far outputs are from the closed form, (n,); angles but for turns."""
    gap = np.abs(found - arm.form(u)[0])
    return np.minimum(gap, np.abs(gap - 2 * np.pi)).max(axis=1)


def arrays(arm: Arm, solver: md.Solver, sizes: dict[int, int]) -> list[dict[str, Any]]:
    """Return seconds of arrays of poses and errors, beside NumPy and C."""
    rows = []
    for count, repeats in sizes.items():
        u = drawn(arm, count, 1)
        poses, (known, _) = solver.poses({}, u), arm.form(u)
        calls: dict[str, Callable[[], Any]] = {
            "mechdae": lambda u=u: solver.poses({}, u),
            "numpy": lambda u=u: arm.form(u),
        }
        closed = in_c(arm, known.shape[1])
        if closed is not None:
            calls["c"] = lambda u=u, closed=closed: closed(u)
        row: dict[str, Any] = {"poses": count, "refused": int((~poses.ok).sum())}
        row |= {f"{name}_us": 1e6 * t / count for name, t in timed(calls, repeats).items()}
        row["error"] = float(np.nanmax(off(arm, outputs(arm, poses), u)))
        row["bound"] = float(np.nanmax(poses.error))
        if closed is not None:
            row["c_error"] = float(np.abs(closed(u) - known).max())
        rows.append(row)
    return rows


def loop(arm: Arm, solver: md.Solver, count: int) -> dict[str, Any]:
    """Return seconds of a call in a loop of small moves, beside NumPy, and the error."""
    t = np.linspace(0, 2 * np.pi, count)[:, None] + np.arange(len(arm.begin))
    u = np.array(arm.begin) + 0.5 * np.array(arm.spread) * (np.sin(t) - np.sin(t[0]))
    poses, pose = [], solver.track(None, u[0])
    spent = []
    for row in u:
        begun = time.process_time()
        pose = solver.track(pose, row)
        spent.append(time.process_time() - begun)
        poses.append(pose)
    plain = []
    for row in u[:: max(1, count // 200)]:
        begun = time.process_time()
        arm.form(row[None])
        plain.append(time.process_time() - begun)
    found = np.vstack([outputs(arm, each) for each in poses])
    return {
        "calls": count,
        "mechdae_us": 1e6 * float(np.median(spent)),
        "mean_us": 1e6 * float(np.mean(spent)),
        "numpy_us": 1e6 * float(np.median(plain)),
        "error": float(off(arm, found, u).max()),
        "refused": sum(not each.ok[0] for each in poses),
    }


def jumps(arm: Arm, solver: md.Solver, count: int) -> dict[str, Any]:
    """Return what comes of calls far from each other: wrong ones, refused ones without a limit."""
    u = drawn(arm, count, 2, arm.jumps)
    pose, here = solver.track(None, np.array(arm.begin)), np.array(arm.begin)
    usual = arm.form(here[None])[1][0]
    wrong = refused = unsaid = 0
    for row in u:
        pose = solver.track(pose, row)
        if pose.ok[0]:
            gap = off(arm, outputs(arm, pose), row[None])[0]
            wrong += not gap <= WRONG
            here = row
            continue
        refused += 1
        way = here + np.linspace(0, 1, 401)[:, None] * (row - here)
        margin = arm.form(way)[1]
        unsaid += bool(margin.min() > NEAR * usual)
    return {"calls": count, "wrong": wrong, "refused": refused, "no_limit_near": unsaid}


@np.errstate(invalid="ignore", divide="ignore")
def measured(arm: Arm, sizes: dict[int, int], calls: int, thrown: int) -> dict[str, Any]:
    """Return all figures of one case."""
    solver = md.Solver(arm.problem, arm.task)
    return {
        "name": arm.name,
        "arrays": arrays(arm, solver, sizes),
        "loop": loop(arm, solver, calls),
        "jumps": jumps(arm, solver, thrown),
    }


def shown(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"


def page(records: list[dict[str, Any]]) -> str:
    """Return the table of the page."""
    heads = (
        "microseconds a pose (as multiples of NumPy, of C)", "1", "100", "100 000",
        "largest error", "a call in a loop (NumPy)", "wrong of jumps", "refused, no limit near",
    )  # fmt: skip
    lines = [heads, ("---",) * len(heads)]
    for record in records:
        cells = [record["name"]]
        for row in record["arrays"]:
            ratios = [shown(row["mechdae_us"] / row[f"{name}_us"])
                      for name in ("numpy", "c") if f"{name}_us" in row]  # fmt: skip
            cells.append(f"{shown(row['mechdae_us'])} ({', '.join(ratios)})")
        each, thrown = record["loop"], record["jumps"]
        error = max(each["error"], *(row["error"] for row in record["arrays"]))
        cells += [f"{error:.1e}", f"{shown(each['mechdae_us'])} ({shown(each['numpy_us'])})"]
        cells += [f"{thrown['wrong']} of {thrown['calls']}"]
        cells += [f"{thrown['refused']}, {thrown['no_limit_near']}"]
        lines.append(tuple(cells))
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def main() -> None:
    """Measure, write the figures and the table."""
    parser = argparse.ArgumentParser(description="arms and platforms beside closed forms")
    arguments(parser)
    parser.add_argument("--jumps", type=int, default=JUMPS)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    chosen = [arm for arm in arms() if arm.name.startswith(options.only)]
    records = []
    for arm in chosen:
        records.append(measured(arm, SIZES, LOOP, options.jumps))
        print(json.dumps(records[-1]), flush=True)
    written(options, records, page(records), BEGIN, END)


if __name__ == "__main__":
    main()
