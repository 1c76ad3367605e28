"""Slips planted in synthesis, seen by closed forms of four-bars and of curves."""

from __future__ import annotations

from math import pi

import numpy as np

import mechdae as md
from mechdae.design.synthesis.exact.four_bars import guiding_links
from mechdae.design.synthesis.fourbar.freudenstein import function_starts
from mechdae.design.synthesis.fourbar.linkage import (
    PlanePoses,
    are_cognates,
    cognates,
    linkage,
)
from mechdae.design.synthesis.goals.path_generation import wound
from mechdae.design.synthesis.goals.straight import lines_of
from mechdae.design.synthesis.synthesize import synthesize
from mechdae.design.synthesis.trace import maxima, ordered
from tests.attack.planted_designs import wrong
from tests.reference.closure_fourbar import FourBar, judged
from tests.shared import begun_cases
from tests.shared.planting import Slip

LENGTHS, POINT = (4.0, 1.5, 3.5, 3.0), 1.2 + 0.9j
TURN = 2 * pi


def apart(found: object, wanted: object, allowed: float = 1e-8) -> float:
    """Return the largest difference over what is allowed, infinite for what is no number."""
    gap = float(np.max(np.abs(np.asarray(found) - np.asarray(wanted)), initial=0.0))
    return gap / allowed if np.isfinite(gap) else np.inf


def plant(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return crank pins, rocker pins and coupler points of a four-bar on the ground line."""
    made = FourBar(LENGTHS, POINT)
    P = made.moved(theta, (1,))[0]["point"]
    A = LENGTHS[1] * np.exp(1j * theta)
    return A, A + (P - A) * LENGTHS[2] / POINT, P


THETA = np.linspace(0.3, 5.5, 9)
OFF = 0.03 * np.exp(2j * np.arange(9))
TARGETS = plant(THETA)[2] + OFF


def same_curve() -> float:
    """Cognates meet the plant's coupler points with their own links, and are told as such."""
    design = linkage(0j, LENGTHS[0] + 0j, *plant(THETA))
    gaps = [apart(one.points(), plant(THETA)[2]) for one in cognates(design)]
    known = all(are_cognates(design, one) for one in cognates(design))
    return max(*gaps, 0.0 if known else np.inf)


def angles() -> float:
    """In which sense a crank visits its poses: forward, backward, in neither."""
    found = [
        linkage(0j, LENGTHS[0] + 0j, *plant(theta)).sense
        for theta in (THETA, THETA[::-1], np.array([0.3, 2.0, 1.0, 4.0]))
    ]
    return 0.0 if found == [1, -1, 0] else np.inf


def five_poses() -> float:
    """Both dyads of the plant are among those of five of its poses."""
    A, B, _ = plant(THETA[::2])
    turns = np.angle(B - A)
    poses = PlanePoses(A + 0.7 * np.exp(1j * turns), turns)
    found, _ = guiding_links(poses)
    wanted = [(0j, -0.7 + 0j, LENGTHS[1]), (LENGTHS[0] + 0j, LENGTHS[2] - 0.7 + 0j, LENGTHS[3])]
    gaps = [
        min(max(abs(one.pivot - G), abs(one.pin - w), abs(one.length - L)) for one in found)
        for G, w, L in wanted
    ] if found else [np.inf]  # fmt: skip
    return max(gaps) / 1e-7


def functions() -> float:
    """What starts of a function generator say of themselves is so in closed form."""
    share = np.linspace(0, 1, 7)
    inputs, outputs = pi / 2 * share, pi / 2 * (np.exp(share) - 1) / (np.e - 1)
    starts = function_starts(inputs, outputs, keep=2, samples=600)
    if not starts or starts[0].worst > 0.01:
        return np.inf
    gaps = []
    for start in starts:
        verdict = judged(
            FourBar(tuple(start.lengths)), start.input_start + inputs,
            start.output_start + start.sense * outputs, full_turn=False, ordered=False,
            output="output", signs=(start.branch,),
        )  # fmt: skip
        gaps.append(apart(verdict.errors.max(), start.worst))
    return max(gaps)


def curves() -> float:
    """Local maxima of a curve between the places of a grid."""
    at, values = maxima(lambda s: np.sin(3 * s), np.linspace(0, 2.5, 21))
    return max(apart(at, [pi / 6, 5 * pi / 6][: len(at)] if len(at) == 1 else [pi / 6, 2.5], 1e-3),
               apart(values, [1.0, np.sin(7.5)], 1e-5))  # fmt: skip


def visits() -> float:
    """Targets that are visited in order on a closed curve, the cheapest places of all."""
    n, wanted = 12, [10, 13, 17]
    costs = np.ones((n, 3))
    for k, place in enumerate(wanted):
        costs[place % n, k] = 0.1 * k
    total, places = ordered(costs, worst=False, closed=True)
    worst, _ = ordered(costs, worst=True, closed=True)
    costs[:, 2] = costs[:, 1]  # the last two at one place: one of them gives way
    both, _ = ordered(costs, worst=False, closed=True)
    shortest = wound(np.array([6.2, 0.3, 13.0]))
    return max(
        apart(total, 0.3), apart(worst, 0.2), apart(both, 1.1),
        apart(np.asarray(places) % n, np.mod(wanted, n)),
        apart(np.ptp(shortest), 13.0 - TURN - 6.2),
    )  # fmt: skip


def lines() -> float:
    """Points beside a line that is turned: direction, offset, deviation, stroke."""
    s, off = np.linspace(0, 2, 5), 0.01 * np.array([0, 1, 0, -1, 0])
    z = (s + 1j * (0.3 + off)) * np.exp(0.5j)
    way, offset, worst, stroke, ahead = lines_of(np.stack([z.real, z.imag], axis=1)[None])
    return max(
        apart(way, 0.5), apart(offset, 0.3), apart(worst, 0.01), apart(stroke, 2.0),
        0.0 if ahead.all() else np.inf,
    )  # fmt: skip


def problem() -> md.Problem:
    """The plant, begun elsewhere, along nearly its own points by the crank's angle."""
    mechanism = md.Mechanism(
        parameters={"b": 1.3, "c": 3.2, "d": 3.3, "x": 1.0, "y": 1.1},
        ground=md.Ground({"O": (0, 0), "C": (LENGTHS[0], 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": ("b", 0)}),
            md.Body("coupler", {"A": (0, 0), "B": ("c", 0), "P": ("x", "y")}),
            md.Body("rocker", {"C": (0, 0), "B": ("d", 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"), md.Revolute("A", "crank.A", "coupler.A"),
            md.Revolute("B", "coupler.B", "rocker.B"), md.Revolute("C", "ground.C", "rocker.C"),
        ],
        sketch={"crank": 1.0, "coupler": 0.5, "rocker": 1.5},
    )  # fmt: skip
    goal = {"kind": "path", "point": "coupler.P", "at": THETA.tolist(),
            "targets": np.stack([TARGETS.real, TARGETS.imag], axis=1).tolist()}  # fmt: skip
    task = md.Synthesis(
        driver={"coordinate": "crank.angle"}, goal=goal, starts=1, seed=2,
        free={"b": [1.0, 2.0], "c": [2.5, 4.5], "d": [2.0, 4.0], "x": [0, 2], "y": [0, 2]},
        constraints=[{"kind": "full-turn"}],
    )  # fmt: skip
    return md.Problem(mechanism, {"d": task})


def path() -> float:
    """A design is at least as good as the plant, and what is said of it is so."""
    own = problem()
    result = synthesize(own, "d", own.tasks["d"])
    designs = result.data["designs"]
    if not designs:
        return np.inf
    p, design = designs[0]["parameters"], designs[0]
    made = FourBar((LENGTHS[0], p["b"], p["c"], p["d"]), complex(p["x"], p["y"]))
    squares = float(np.sum(np.abs(made.moved(THETA, (1,))[0]["point"] - TARGETS) ** 2))
    a, b, c, d = LENGTHS[0], p["b"], p["c"], p["d"]
    cosine = [(c * c + d * d - (a + s * b) ** 2) / (2 * c * d) for s in (1, -1)]
    wanted = min(min(angle, pi - angle) for angle in np.arccos(cosine))
    return max(
        squares / np.sum(np.abs(OFF) ** 2) / 2, apart(design["objective"], squares),
        apart(design["transmission_angle_min"], wanted),
    )  # fmt: skip


def planted() -> float:
    """Designs that do not do what is asked are seen, and sound ones are not."""
    bad = [name for kind in ("functions", "paths") for name in wrong(kind, 2)[1]]
    return np.inf if bad else 0.0


SEEN = "synthesis/test_verification.py::test_designs_that_do_something_else_are_seen"
SUITE = "synthesis/test_exact.py::"
SLIPS = [
    Slip(
        "design.synthesis.fourbar.linkage",
        "B3 + third * (1 - z)",
        "B3 + third * z",
        same_curve,
        SUITE + "test_cognates_trace_the_same_curve",
    ),
    Slip(
        "design.synthesis.fourbar.linkage",
        "np.stack([rocker, crank, coupler], axis=1)",
        "np.stack([crank, rocker, coupler], axis=1)",
        same_curve,
        SUITE + "test_cognates_trace_the_same_curve",
    ),
    Slip(
        "design.synthesis.fourbar.linkage",
        "np.mod(sense * steps, TURN)",
        "np.mod(steps, TURN)",
        angles,
        SUITE + "test_order_of_angles",
    ),
    Slip(
        "design.synthesis.fourbar.linkage",
        "np.sign((rocker * coupler.conj()).imag)",
        "np.sign((rocker * coupler).imag)",
        same_curve,
        SUITE + "test_cognates_trace_the_same_curve",
    ),
    Slip(
        "design.synthesis.exact.four_bars",
        "complex(size * z[W]",
        "complex(z[W]",
        five_poses,
        SUITE + "test_burmester_public_case",
    ),
    Slip(
        "design.synthesis.exact.four_bars",
        "size * z[G]",
        "z[G]",
        five_poses,
        SUITE + "test_burmester_public_case",
    ),
    Slip(
        "design.synthesis.fourbar.freudenstein",
        "psi - d[:, 4:] - self.outputs",
        "psi - d[:, 4:] + self.outputs",
        functions,
        "synthesis/test_freudenstein.py::test_what_a_start_says_is_true",
    ),
    Slip(
        "design.synthesis.fourbar.freudenstein",
        "float(np.abs(e).max())",
        "float(e.max())",
        functions,
        "synthesis/test_freudenstein.py::test_what_a_start_says_is_true",
    ),
    Slip(
        "design.synthesis.fourbar.freudenstein",
        "b * line / size",
        "b * line",
        functions,
        "synthesis/test_freudenstein.py::test_what_a_start_says_is_true",
    ),
    Slip(
        "design.synthesis.trace",
        "np.minimum(tops + 1, last)",
        "np.minimum(tops, last)",
        curves,
        "synthesis/test_synthesis_repairs.py::test_the_largest_errors_of_a_minimax_are_alike",
    ),
    Slip(
        "design.synthesis.trace",
        "least[:, :-1]",
        "least[:, 1:]",
        visits,
        "synthesis/test_synthesis_planted.py::test_path_of_a_four_bar",
    ),
    Slip(
        "design.synthesis.goals.path_generation",
        "int(np.argmax(gaps)) + 1",
        "int(np.argmax(gaps))",
        visits,
        "attack/test_slips.py::test_nothing_is_off_without_a_slip",
    ),
    Slip(
        "design.synthesis.goals.straight",
        "(low + high) / 2, (high - low) / 2",
        "(low + high) / 2, high - low",
        lines,
        "attack/test_slips.py::test_nothing_is_off_without_a_slip",
    ),
    Slip(
        "design.synthesis.verification.verify",
        "float(np.sum(weights * errors**2))",
        "float(np.sum(weights * errors))",
        path,
        "synthesis/test_synthesis_planted.py::test_path_of_a_four_bar",
    ),
    Slip(
        "design.synthesis.verification.design_file",
        'e["min"]',
        'e["max"]',
        path,
        "synthesis/test_synthesis.py::test_path_cases_reach_their_bar_without_defects",
    ),
    Slip(
        "design.synthesis.verification.verify",
        'claim.sense if goal.sense == "free" else 1.0',
        "claim.sense",
        planted,
        SEEN,
    ),
    Slip(
        "design.synthesis.verification.verify",
        "((steps > 0).all() or (steps < 0).all())",
        "(steps != 0).all()",
        planted,
        SEEN,
    ),
    Slip(
        "design.synthesis.verify",
        "angles |= self._slides()",
        "pass",
        begun_cases.slotted,
        "dynamics/test_first_poses.py::test_modes_that_differ_by_a_slide_are_told_apart",
    ),
    Slip(
        "design.synthesis.verify",
        'if n.split(".")[0] not in parts',
        "if n not in self.sketch",
        begun_cases.told_twice,
        "dynamics/test_first_poses.py::test_a_design_forgets_the_rough_sketch_it_comes_from",
    ),
]
