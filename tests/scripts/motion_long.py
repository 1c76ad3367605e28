"""Motions that take longer than a test may: ``python -m tests.scripts.motion_long``.

The ladder of parallelograms from 16 starts at three tolerances, with 40 loops over 20 s, and over
many revolutions; the pendulum over 1000 s; Andrews' mechanism against scipy on the same
right-hand side, where scipy is installed.
"""

from __future__ import annotations

import json
import math
import time

import numpy as np

import mechdae as md
from mechdae.dynamics.integrate import DormandPrince
from mechdae.dynamics.task import motion_start
from tests.shared.paths import DATA


def reference(name: str, t: float) -> dict:
    data = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    return next(state for state in data["states"] if float(state["t"]) == t)


def angle_after(start: float, speed: float, end: float) -> float:
    """Return the angle of the ladder's cranks, N = 2, by their own equation in 80-bit floats."""
    inertia, moment = np.longdouble(3), np.longdouble("34.335")
    from mechdae.kernels.graphs.stepper import STAGES

    steps = 4000
    h = np.longdouble(end) / steps
    y = np.array([start, speed], dtype=np.longdouble)
    for _ in range(steps):
        k: list = []
        for i in range(12):
            at = y + h * sum((np.longdouble(w) * k[j] for j, w in STAGES[i].items()), 0 * y)
            k.append(np.array([at[1], -moment / inertia * np.cos(at[0])]))
        y = y + h * sum(np.longdouble(w) * k[j] for j, w in STAGES[12].items())
    return float(y[0])


def starts() -> None:
    draw = np.random.default_rng(16)
    problem = md.load("n-four-bar")
    places = [(draw.uniform(0.2, 2.9), draw.uniform(-5, 5)) for _ in range(16)]
    wanted = [angle_after(angle, speed, 10.0) for angle, speed in places]
    for tol in (1e-6, 1e-9, 1e-11):
        errors, failed = [], 0
        for (angle, speed), exact in zip(places, wanted, strict=True):
            task = md.Motion(
                start={"crank0.angle": angle},
                start_speed={"crank0.angle": speed},
                at=[10.0],
                tolerance=tol,
            )
            result = md.solve(problem.with_task("m", task), "m")
            errors.append(abs(result.bodies["crank0"].angle[0] - exact))
            failed += bool(result.fault) or errors[-1] > 1e-2
        print(
            f"ladder N = 2, 10 s, 16 starts, tolerance {tol:g}: {failed} failures, median error "
            f"{np.median(errors):.1e}, worst {max(errors):.1e}"
        )


def loops() -> None:
    from tests.reference.pendulums import passages

    wanted = reference("iftomm_a02_n40", 20.0)
    for tol in (1e-6, 1e-8, 1e-10, 1e-11):
        result = md.solve("n-four-bar", "motion", set={"N": 40, "tol": tol, "t_end": 20.0})
        place = [result.summary["state"][name][0] for name in ("B0x", "B0y")]
        gap = max(abs(place[0] - float(wanted["B0x"])), abs(place[1] - float(wanted["B0y"])))
        times = np.array([event["at"] for event in result.events])
        late = np.max(np.abs(times - passages(40, len(times))))
        print(
            f"ladder N = 40, 20 s, tolerance {tol:g}: error {gap:.1e}, {len(times)} passages "
            f"within {late:.1e} s, {result.summary['steps']} + {result.summary['rejected']} steps"
        )


def revolutions(count: int = 10_000) -> None:
    period = 1.9425149226070836835009280283101
    for tol in (1e-9, 1e-11):
        problem = md.load("n-four-bar")
        task = md.Motion(
            start={"crank0.angle": math.pi / 2},
            start_speed={"crank0.angle": -1.0},
            at=[count * period],
            tolerance=tol,
        )
        result = md.solve(problem.with_task("m", task), "m")
        gap = result.bodies["crank0"].angle[0] - math.pi / 2 + 2 * math.pi * count
        print(
            f"ladder N = 2, {count} revolutions, tolerance {tol:g}: angle off by {gap:.1e} rad, "
            f"{len(result.events)} passages, energy {result.checks['energy']:.1e}, "
            f"{result.summary['steps']} steps {result.fault or ''}"
        )


def pendulum() -> None:
    for tol in (1e-12, 1e-13):
        result = md.solve("pendulum", "motion", set={"tol": tol, "t_end": 1000.0})
        energy = np.max(np.abs(result.scalars.energy))
        print(f"pendulum 1000 s, tolerance {tol:g}: energy {energy:.1e} J, {len(result)} states")


def andrews() -> None:
    try:
        from scipy.integrate import solve_ivp
    except ImportError:
        return
    wanted = np.array([float(text) for text in reference("andrews", 0.03)["q"]])
    names = "K1 K2 K3 K4 K5 K6 K7".split()
    back = np.eye(7)
    back[1, 0] = back[3, 4] = back[5, 6] = -1.0  # angles between bodies
    problem = md.load("andrews-squeezer")

    for tol in (1e-8, 1e-10, 1e-12):
        changed = problem.with_values({"tol": tol})
        setup, _, x, v = motion_start(changed, changed.tasks["motion"])
        integrator = DormandPrince(setup)
        order = [
            [name for name, _ in setup.released.coordinates.keys].index(name) for name in names
        ]
        none = np.zeros(0)
        works = np.zeros(len(setup.works))
        state = integrator.first(0.0, x, v, works, none)
        list(integrator.steps(state, none))
        ours, theirs = [], []
        for _ in range(7):
            begin = time.process_time()
            nodes = list(integrator.steps(state, none))
            ours.append(time.process_time() - begin)
            call = integrator._rhs

            def slope(t: float, y: np.ndarray, call=call, none=none) -> np.ndarray:
                return np.concatenate([y[7:], call(t, y[:7], y[7:], none)[0]])

            begin = time.process_time()
            other = solve_ivp(
                slope, (0, 0.03), np.concatenate([x, v]), method="DOP853", rtol=tol, atol=tol
            )
            theirs.append(time.process_time() - begin)
        end = nodes[-1].states[-1][integrator.layout["x"]][order]
        gap = np.max(np.abs(back @ end - wanted) / np.maximum(1, np.abs(wanted)))
        away = np.max(
            np.abs(back @ other.y[:7, -1][order] - wanted) / np.maximum(1, np.abs(wanted))
        )
        print(
            f"Andrews, tolerance {tol:g}: {1e3 * np.median(ours):.1f} ms, error {gap:.1e}; scipy "
            f"DOP853 {1e3 * np.median(theirs):.1f} ms, error {away:.1e}, same right-hand side; "
            f"ratio {np.median(ours) / np.median(theirs):.2f}"
        )


def stiff() -> None:
    """Double pendulums with a damper of 1e4 over 5 s beside CVODES' BDF without projection."""
    from benchmarks.integrators import sundials
    from mechdae.describe.file.load import from_dict
    from mechdae.dynamics.bdf import Cvodes
    from mechdae.parts.bench.motions import work_of
    from tests.reference.pendulums import radau
    from tests.shared.pendulums import bobs, pendulum

    for name, make in (("hinge", pendulum), ("bars", bobs)):
        a, b, *_ = radau(*((1e4, 0.0) if name == "hinge" else (0.0, 1e4)), 5.0, 3000)
        place = [math.sin(a), -math.cos(a), math.sin(a) + math.sin(b), -math.cos(a) - math.cos(b)]
        wanted = np.array([a, b] if name == "hinge" else place)
        for tol in (1e-6, 1e-8, 1e-10):
            problem = from_dict(make(1e4, at=[5.0], tolerance=tol))
            work = work_of(problem)
            work.setup.tolerance = tol
            own, none = Cvodes(work.setup), work.none
            begin = own.first(0.0, work.x, work.v, np.zeros(len(work.setup.works)), none)
            plain = next(way for m, _, way in sundials(work, (tol,)) if m == "CVODES BDF")
            drift, times = 0.0, ([], [])
            for _ in range(9):
                start = time.process_time()
                for nodes in own.steps(begin, none):
                    x = nodes.states[-1][own.layout["x"]]
                times[0].append(time.process_time() - start)
                start = time.process_time()
                other = plain()
                times[1].append(time.process_time() - start)
            for nodes in own.steps(begin, none):
                drift = max(drift, *(work.drift(s[own.layout["x"]]) for s in nodes.states))
            ours, theirs = (float(np.median(part)) for part in times)
            print(
                f"stiff {name}, tolerance {tol:g}: {1e3 * ours:.2f} ms, error "
                f"{np.max(np.abs(x - wanted)):.1e}, gap {drift:.1e}; plain CVODES BDF "
                f"{1e3 * theirs:.2f} ms, error {np.max(np.abs(other.x - wanted)):.1e}, gap "
                f"{work.drift(other.x):.1e}; ratio {ours / theirs:.2f}"
            )


if __name__ == "__main__":
    for part in (andrews, pendulum, stiff, starts, loops, revolutions):
        part()
