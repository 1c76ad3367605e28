"""Slips planted in the measures of sweeps, seen on a slider-crank in closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import acos, asin, hypot, pi, sqrt

import numpy as np

import mechdae as md
from mechdae.numerics.changes import changes
from tests.shared.planting import Slip

R, L, E = 0.1, 0.3, 0.04
"""Crank, rod, offset of the slider's line."""
TOP, BOTTOM = asin(E / (L + R)), pi + asin(E / (L - R))
"""Angles of the crank at the ends of the stroke."""
FAR, NEAR = sqrt((L + R) ** 2 - E**2), sqrt((L - R) ** 2 - E**2)
SHARE = 0.02
SUITE = "measures/"


@cache
def crank() -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (0, E)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "B": (R, 0)}),
            md.Body("rod", {"B": (0, 0), "C": (L, 0)}),
            md.Body("slider", {"C": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("B", "crank.B", "rod.B"),
            md.Revolute("C", "rod.C", "slider.C"),
            md.Prismatic("guide", "ground.G", "slider.C"),
        ],
        sketch={"crank": 0.5, "rod": -0.1, "guide": 0.35},
    )


def swept(*measures: str, to: float = 0.5 + 2 * pi, **keys: object) -> md.Result:
    driver = md.Driver("crank.angle", from_=0.5, to=to)
    task = md.Sweep(driver, poses=25, measures=measures, **keys)
    return md.solve(md.Problem(crank(), {"t": task}), "t")


def off(found: float, wanted: float, allowed: float = 1e-8) -> float:
    gap = abs(found - wanted)
    return gap / allowed if np.isfinite(gap) else np.inf


def slide(theta: float) -> float:
    return R * np.cos(theta) + sqrt(L**2 - (E - R * np.sin(theta)) ** 2)


def strokes() -> float:
    found = swept("time-ratio").summary
    forth = BOTTOM - TOP
    return max(
        off(found["time_ratio"]["guide"], forth / (2 * pi - forth)),
        off(found["return_angle"]["guide"], 2 * pi - forth),
    )


def dwell() -> float:
    """The longest of a slider at its far end: it stays within a band that begins there."""
    entries = swept("dwell", dwell_tolerance=SHARE).summary["dwell"]["guide"]
    half = SHARE * (FAR - NEAR)
    entry = min(entries, key=lambda own: abs(own["mean"] - (FAR - half)))
    ends = [(entry[word], slide(entry[word])) for word in ("from", "to")]
    worst = max(off(place, FAR - 2 * half) for _, place in ends)
    return max(worst, off(entry["mean"], FAR - half), off(entry["within"], half))


def places() -> float:
    """Where the slide passes a value, rising and falling, and a pole that is no passage."""
    half = (FAR + NEAR) / 2
    wanted = {"output": "guide.slide", "crosses": half}
    pole = {"output": f"1/(guide.slide - {half!r})", "crosses": 0}
    events = swept(find=[wanted, pole]).events
    if [event.direction for event in events] != ["down", "up"]:
        return np.inf
    return max(off(slide(event.at), half) for event in events)


def transmission() -> float:
    found = swept("transmission")
    angle = found.joints["C"].transmission_angle
    theta = found.drivers["crank.angle"].position
    wanted = pi / 2 - np.abs(np.arcsin((E - R * np.sin(theta)) / L))
    least = found.summary["transmission"]["C"]
    return max(
        float(np.abs(angle - wanted).max()) / 1e-8,
        off(least["min"], acos((E + R) / L)),
        off(least["at"], 3 * pi / 2, 1e-6),
        off(least["max"], pi / 2),
    )


def extremes() -> float:
    found = swept("extremes", "envelope")
    own = found.summary["extremes"]["guide.slide"]
    box = found.summary["envelope"]["bodies"]["slider"]
    kinds = {e["extreme"]: e["at"] for e in found.events if e.get("of") == "guide.slide"}
    return max(
        off(own["max"]["value"], FAR), off(own["min"]["value"], NEAR),
        off(own["max"]["at"], TOP + 2 * pi), off(own["min"]["at"], BOTTOM),
        off(kinds["min"], BOTTOM), off(box[0], NEAR), off(box[1], FAR), off(box[3], E),
    )  # fmt: skip


def curve() -> float:
    """The crank's pin on its circle, backwards."""
    found = swept("curve", to=0.5 - 2 * pi)
    pin, facts = found.points["crank.B"], found.summary["curve"]["crank.B"]
    theta = found.drivers["crank.angle"].position
    tangent = np.angle(np.exp(1j * (pin.tangent - theta - pi / 2)))
    return max(
        off(facts["length"], 2 * pi * R), off(facts["area"], -pi * R * R),
        float(np.abs(tangent).max()) / 1e-8, float(np.abs(pin.curvature - 1 / R).max()) / 1e-8,
    )  # fmt: skip


def centre() -> float:
    """The rod's centre lies on the crank's line, above the slider."""
    found = swept("centrodes")
    theta = found.drivers["crank.angle"].position
    C = np.array([slide(angle) for angle in theta])
    wanted = np.stack([C, C * np.tan(theta)], axis=1)
    rod = found.bodies["rod"]
    turn = rod.angle
    B = R * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    arm = wanted - B
    own = [np.cos(turn) * arm[:, 0] + np.sin(turn) * arm[:, 1],
           np.cos(turn) * arm[:, 1] - np.sin(turn) * arm[:, 0]]  # fmt: skip
    size = 1 + hypot(*np.abs(wanted).max(axis=0))
    return max(
        float(np.abs(rod.centrode_fixed - wanted).max()) / size,
        float(np.abs(rod.centrode_moving - np.stack(own, axis=1)).max()) / size,
    ) / 1e-8  # fmt: skip


def worn() -> float:
    """A heavy crank presses on its pin with m r w^2 all the time."""
    mass, speed, pin, width = 2.0, 30.0, 0.02, 0.03
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0)}, mass=mass, center=(R, 0))],
        joints=[md.Revolute("O", "ground.O", "crank.O", pin_radius=pin, face_width=width)],
    )
    driver = md.Driver("crank.angle", from_=0.0, to=4 * pi, speed=speed)
    wear = md.solve(mechanism, md.Reactions(driver=driver, cycle=True)).summary["wear"]["O"]
    pressure = mass * R * speed**2 / (2 * pin * width)
    expected = {"peak_pressure": pressure, "peak_pv": pressure * pin * speed,
                "mean_pv": pressure * pin * speed, "sliding_distance": 4 * pi * pin}  # fmt: skip
    return max(abs(wear[word] / value - 1) for word, value in expected.items()) / 1e-9


def hollow() -> float:
    """A seal on the long axis of its housing, which is hollow there."""
    problem = md.load("wankel-rotor")
    n = problem.mechanism.values()
    tip, width, modulus = 0.003, 0.08, 2e11
    joints = dict(problem.mechanism.joints)
    joints["housing0"] = replace(
        joints["housing0"], tip_radius=tip, face_width=width, contact_modulus=modulus
    )
    task = problem.tasks["cycle"]
    driver = replace(task.driver, from_=None, to=None, at=(0.0,))
    mechanism = replace(problem.mechanism, joints=joints)
    forces = replace(task, driver=driver, poses=None, cycle=False)
    found = md.solve(replace(problem, mechanism=mechanism), forces).joints["housing0"].pressure[0]
    force = n["S"] + n["m_seal"] * (n["omega"] / 3) ** 2 * (n["R"] - n["d"] + 9 * n["e"])
    bend = (n["R"] + 9 * n["e"]) / (n["R"] + 3 * n["e"]) ** 2
    expected = sqrt(force / width * modulus / (2 * pi) * (1 / tip - bend))
    return abs(found / expected - 1) / 1e-9


def steps() -> float:
    """Changes that are lost where each interval has two: a step, and a sign."""
    grid = np.arange(0.0, 41.0)

    def look(places):
        waves = np.sin(pi * (places - 0.5))
        marks = np.stack([np.floor(places), np.sign(waves)], axis=1).astype(int)
        return marks, np.stack([places, waves], axis=1)

    guides = [("", slice(0)), ("sign", slice(1, 2))]
    places = np.array([place for place, _, _ in changes(grid, *look(grid), guides, look)])
    expected = np.arange(0.5, 40.5, 0.5)
    return float(np.abs(places[:, None] - expected).min(axis=0).max()) / 1e-12


SLIPS = [
    Slip(
        "motion.measures.strokes",
        "(TURN - ratio) / ratio",
        "ratio / (TURN - ratio)",
        strokes,
        SUITE + "test_strokes.py::test_time_ratio_of_slider_cranks_and_quick_returns",
    ),
    Slip(
        "motion.measures.strokes",
        "return min(stroke, TURN - stroke)",
        "return stroke",
        strokes,
        "attack/test_slips.py::test_nothing_is_off_without_a_slip",
    ),
    Slip(
        "motion.measures.dwell",
        "float(inside.max()) - self.half",
        "float(inside.max())",
        dwell,
        SUITE + "test_dwell.py::test_dwells_of_a_slider_crank_and_a_yoke",
    ),
    Slip(
        "motion.measures.dwell",
        "level = mean - self.half if peak else mean + self.half",
        "level = mean - 2 * self.half if peak else mean + self.half",
        dwell,
        SUITE + "test_dwell.py::test_dwells_of_a_slider_crank_and_a_yoke",
    ),
    Slip(
        "motion.measures.transmission",
        "np.arctan2(np.abs(lines[:, 0]), np.abs(lines[:, 1]))",
        "np.arctan2(np.abs(lines[:, 1]), np.abs(lines[:, 0]))",
        transmission,
        SUITE + "test_transmission.py::test_transmission_angle_of_slider_cranks",
    ),
    Slip(
        "motion.measures.transmission",
        "np.stack([turn, s[0], c[0]], axis=1)",
        "np.stack([turn, s[0], s[0]], axis=1)",
        transmission,
        SUITE + "test_transmission.py::test_transmission_angle_of_slider_cranks",
    ),
    Slip(
        "motion.measures.along_sweep_extremes",
        "return -self.before if",
        "return self.before if",
        extremes,
        SUITE + "test_extremes.py::test_extremes_of_a_rocker_and_its_dead_points",
    ),
    Slip(
        "motion.measures.along_sweep",
        'first = 2 * "xyz".index(axis)',
        'first = 2 * "yxz".index(axis)',
        extremes,
        SUITE + "test_extremes.py::test_what_stands_still_has_no_extremes_and_counts_in_the_box",
    ),
    Slip(
        "motion.measures.along_sweep_extremes",
        "max(values) - min(values) if",
        "max(values) if",
        dwell,
        SUITE + "test_dwell.py::test_dwells_of_a_slider_crank_and_a_yoke",
    ),
    Slip(
        "motion.measures.curve",
        "across / speed**3",
        "across / speed**2",
        curve,
        SUITE + "test_curve.py::test_an_ellipse_drawn_by_a_trammel",
    ),
    Slip(
        "motion.measures.curve",
        "across = v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0]",
        "across = v[:, 0] * a[:, 0] + v[:, 1] * a[:, 1]",
        curve,
        SUITE + "test_curve.py::test_an_ellipse_drawn_by_a_trammel",
    ),
    Slip(
        "motion.measures.curve",
        "(x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) / 2",
        "x[:, 0] * v[:, 1] / 2",
        curve,
        SUITE + "test_curve.py::test_an_ellipse_drawn_by_a_trammel",
    ),
    Slip(
        "motion.measures.curve",
        "track.sense * float(area)",
        "float(area)",
        curve,
        SUITE + "test_extremes.py::test_measures_do_not_depend_on_the_poses_nor_on_the_direction",
    ),
    Slip(
        "motion.measures.centres",
        "base + _cross(drift) / turn[:, None]",
        "base - _cross(drift) / turn[:, None]",
        centre,
        SUITE + "test_centres.py::test_centrodes_of_a_trammel_are_cardans_circles",
    ),
    Slip(
        "motion.measures.centres",
        "cos * arm[:, 0] + sin * arm[:, 1]",
        "cos * arm[:, 0] - sin * arm[:, 1]",
        centre,
        SUITE + "test_centres.py::test_centrodes_of_a_trammel_are_cardans_circles",
    ),
    Slip(
        "numerics.quadrature",
        "self.low + width * t, width + 0 * t",
        "self.low + width * t, 0.999 * width + 0 * t",
        curve,
        SUITE + "test_curve.py::test_an_ellipse_drawn_by_a_trammel",
    ),
    Slip(
        "motion.kinematics.finds",
        "abs(self.at(place) - level) <= min(map(abs, ends)) + self.noise",
        "math.isfinite(place)",
        places,
        "forces/test_outputs_of_forces.py::test_a_pole_is_no_crossing",
    ),
    Slip(
        "motion.kinematics.finds",
        "1 if ends[1] > ends[0] else -1",
        "1 if ends[1] > 0 > ends[0] - 1 else 1",
        places,
        "forces/test_outputs_of_forces.py::test_places_of_a_slider_crank_are_those_of_the_closed_form",
    ),
    Slip(
        "forces.wear.wear", "pv / (high - low)", "pv", worn,
        "forces/test_wear.py::test_pins_and_a_block_of_a_slider_crank",
    ),
    Slip(
        "forces.wear.wear", "way / speed", "way", worn,
        "forces/test_wear.py::test_pins_and_a_block_of_a_slider_crank",
    ),
    Slip(
        "forces.wear.wear", "tip - side * curve", "tip + side * curve", hollow,
        "forces/test_wear.py::test_the_seal_of_a_wankel_rotor",
    ),
    Slip(
        "numerics.changes", "EACH * len(k)", "len(k)", steps,
        "forces/test_cycle.py::test_no_change_is_lost_where_every_interval_has_one",
    ),
]  # fmt: skip
