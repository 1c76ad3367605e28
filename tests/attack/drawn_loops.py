"""Random loops by hard points: the drawn pose is the sketch of all tasks, and nothing else is.

    python -m tests.attack.drawn_loops --count 200

Places and axes are drawn at random, so that the truth is what was drawn: a sweep, a motion and an
equilibrium with the driver held begin with every point where it is drawn. The exit code is 1 where
one does not.
"""

from __future__ import annotations

import sys

import numpy as np

import mechdae as md
from tests.attack.spatial_honesty import KINDS, random_turn
from tests.shared import attack
from tests.shared.begun import tasks_of

LOOPS = "RSRC RCSR RUSR RSCP RCCC RCUC RERC REUR RSPU RPSRR".split()
CLOSE = 1e-9


def drawn(seed: int, loop: str) -> md.Mechanism:
    """Return a loop of pairs whose points and axes are places in one pose."""
    rng = np.random.default_rng([seed, 5])
    count = len(loop)
    names = ["ground", *(f"b{k}" for k in range(1, count))]
    places = rng.uniform(-1, 1, (count, 3))
    points: dict[str, dict[str, list[float]]] = {name: {} for name in names}
    joints = []
    for k, letter in enumerate(loop):
        ends = [names[k], names[(k + 1) % count]]
        turn = random_turn(rng)
        for body in ends:
            points[body][f"P{k}"] = places[k].tolist()
        keys = {} if letter == "S" else {"axis": turn[:, 2].tolist()}
        if letter == "U":
            keys["axis2"] = turn[:, 0].tolist()
        joints.append(KINDS[letter](f"J{k}", *[f"{body}.P{k}" for body in ends], **keys))
    for name in names[1:]:
        points[name]["M"] = rng.uniform(-1, 1, 3).tolist()
    bodies = [
        md.Body(name, points[name], mass=1.0, center=[0.0, 0.0, 0.0], inertia=[0.2, 0.3, 0.4])
        for name in names[1:]
    ]
    return md.Mechanism(
        dimension=3, frames="drawn", ground=md.Ground(points["ground"]), bodies=bodies,
        joints=joints,
    )  # fmt: skip


def examine(seed: int, loop: str) -> dict[str, str]:
    """Return what is wrong by task."""
    mechanism = drawn(seed, loop)
    problem = md.Problem(mechanism, tasks=tasks_of({"J0.angle": 0.0}))
    wrong = {}
    for name in ("sweep", "named", "silent", "held"):
        try:
            result = md.solve(problem, name)
        except md.MechdaeError as error:
            wrong[name] = f"{type(error).__name__}: {error.what}"
            continue
        off = 0.0
        for point, series in result.points.items():
            body, own = point.split(".")
            place = np.array(mechanism.bodies[body].points[own], float)
            off = max(off, float(np.abs(series.position[0] - place).max()))
        if result.status[0] != "ok" or not off < CLOSE:
            wrong[name] = f"{result.status[0]}, {off:.3g} from the drawn pose"
    return wrong


def main(arguments=None) -> int:
    options = attack.parser(__doc__, 200, "loops").parse_args(arguments)
    jobs = [(k, LOOPS[k % len(LOOPS)]) for k in range(options.seed, options.seed + options.count)]
    wrong = []
    with attack.processes(options.workers) as run:
        for (seed, loop), found in zip(jobs, run(examine, jobs), strict=True):
            if found:
                wrong.append({"seed": seed, "loop": loop, **found})
                print(wrong[-1], file=sys.stderr, flush=True)
    return attack.ended({"loops": len(jobs), "wrong": wrong}, options.out, wrong)


if __name__ == "__main__":
    sys.exit(main())
