"""Slips planted in contacts of motions, seen by a ball, a rack and a pin in its bush."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.motion.kinematics.prepared import SHAPES
from tests.shared.bouncing import (
    G,
    along_teeth,
    ball,
    carriage,
    disc,
    hits,
    rubbing_slope,
    single_impacts,
    turned_rack,
    wheel_and_rack,
)
from tests.shared.planting import Slip

SUITE = "dynamics/test_contacts.py::"


def moved(data: dict[str, Any]) -> md.Result:
    SHAPES.clear()  # kernels that are kept know nothing of a slip
    try:
        return md.solve(from_dict(data), "m")
    finally:
        SHAPES.clear()


def off(found: list[float], wanted: list[float]) -> float:
    if len(found) < len(wanted):
        return np.inf
    return float(np.abs(np.array(found[: len(wanted)]) - wanted).max() / 1e-9)


def bounces() -> float:
    first = math.sqrt(2 / G)
    return off(hits(moved(ball(0.5, 1.0))), [first, 2 * first])


def impact_losses() -> float:
    return float(moved(ball(0.5, 1.0)).checks["energy"] / 1e-9)


def flank_times() -> float:
    return off(hits(moved(wheel_and_rack(start_speed={"wheel": 10.0, "guide": 0.0}))), [1e-3])


def teeth_on_bearings() -> float:
    result = moved(turned_rack())
    bearing = result.joints["O"].reaction[[0, -1], 0]
    return float(np.abs(bearing - along_teeth(np.array([1.0, -0.5]))).max() / 1e-9)


def rests_at_stops() -> float:
    result = moved(rubbing_slope(0.7, 0.1, 0.0, 1.0))
    alone = np.isfinite(result.joints["floor"].contact_force[-1])
    return np.inf if result.fault or alone else 0.0


def touches() -> float:
    at_rest = {"wall": 0.0, "slot": 0.0}
    result = moved(carriage((1, 1), ([0, 1], [0, 1]), (0, 0), start=at_rest, start_speed=at_rest))
    return np.inf if result.fault or hits(result, "release") else 0.0


def law_into_a_stop() -> float:
    drivers = [{"coordinate": "wall.slide", "law": "0.5 - t"}]
    data = carriage((1, 1), ([0, 1], [0, 1]), (0.5, 0.5), start={"slot": 0.5}, drivers=drivers)
    with np.errstate(all="ignore"):
        return 0.0 if "into its stop" in str(moved(data).fault) else np.inf


def chords() -> float:
    return off(hits(moved(disc(1.0, 0.2, 0.02))), [math.sqrt(3) / 2 * 1e-3 / 0.2])


def one_after_the_other() -> float:
    found, wanted = single_impacts()
    return off(found, wanted) if len(found) == 2 else np.inf


def notes() -> float:
    """A guide that rubs, with a clearance: as an ideal joint, then in its gap."""
    data = wheel_and_rack(start_speed={"wheel": 10.0}, until=1e-4, poses=2)
    data["joints"]["guide"] |= {"friction": 0.1, "clearance": 1e-3}
    texts = ("no restitution", "takes nothing from an impact", "gap without friction")
    for more, wanted in ({}, [1, 1, 0]), ({"restitution": 0.5}, [0, 0, 1]):
        data["joints"]["guide"] |= more
        found = moved(data).summary["notes"]
        if [sum(text in note for note in found) for text in texts] != wanted:
            return np.inf
    return 0.0


def falls_through() -> float:
    """A floor without a restitution stops no ball: it is below from sqrt(2 / g) on."""
    data = ball(0.5, 1.0, poses=11)
    data["joints"]["floor"].pop("restitution")
    result = moved(data)
    below = result.time > math.sqrt(2 / G)
    return 0.0 if (result.status == np.where(below, "stopped", "ok")).all() else np.inf


BALL = SUITE + "test_a_ball_bounces_until_it_lies_still"
SAID = SUITE + "test_what_a_gap_does_without_is_said"
SLIPS = [
    Slip("dynamics.contacts.impacts", "before + e * np.minimum(", "before - e * np.minimum(",
         bounces, BALL),
    Slip("dynamics.contacts.hit", "(self.before + self.after) / 2",
         "(self.before + self.after)", impact_losses, BALL),
    Slip("dynamics.contacts.impacts", "if len(before) < 2 or", "if len(closing) < 2 or",
         one_after_the_other, SUITE + "test_a_block_that_touches_makes_an_impact_not_unique"),
    Slip("dynamics.contacts.impacts", "(*order, *others)", "order", one_after_the_other,
         SUITE + "test_single_impacts_follow_one_another"),
    Slip("dynamics.contacts.touching", "(dry & model.in_gaps)", "(dry - model.in_gaps)", notes,
         SAID),
    Slip("dynamics.contacts.touching", "dry - model.in_gaps,", "dry & model.in_gaps,", notes, SAID),
    Slip("dynamics.contacts.touching", "if name not in model.in_gaps", "if name in model.in_gaps",
         notes, SAID),
    Slip("motion.cases.stops.stops", "if not (rebound and", "if (rebound and", falls_through,
         SUITE + "test_limits_without_a_restitution_are_passed_with_a_word"),
    Slip("equations.forces.dry_friction", "forms=contact.sign * one.forms", "forms=one.forms",
         teeth_on_bearings, SUITE + "test_teeth_change_flanks_where_the_torque_changes_its_sign"),
    Slip("dynamics.contacts.hit", "share <= FIXED", "share < 0", law_into_a_stop,
         SUITE + "test_a_law_that_drives_into_a_stop_says_so"),
    Slip("dynamics.contacts.touching", "held + self._none[closed]", "held - self._none[closed]",
         touches, SUITE + "test_contacts_that_touch_without_a_force_stay_closed"),
    Slip("dynamics.watchers.sliding", "(moved <= RANK * without)", "(moved > 2 * without)",
         rests_at_stops, SUITE + "test_what_rubs_rests_at_a_stop"),
    Slip("dynamics.unique", "(~known[holding.rows :] & locked)",
         "(~known[holding.rows :] & ~locked)",
         rests_at_stops, SUITE + "test_what_rubs_rests_at_a_stop"),
    Slip("dynamics.contacts.gaps", "half + sign * form", "2 * half + sign * form", flank_times,
         SUITE + "test_a_rack_is_hit_by_one_flank_after_the_other"),
    Slip("dynamics.contacts.gaps", "(c - ca.sumsqr(model.ends[name].gap) / c) / 2",
         "(2 * c - ca.sumsqr(model.ends[name].gap) / c) / 2", chords,
         SUITE + "test_a_pin_flies_along_chords_of_its_bush"),
]  # fmt: skip
