"""Slips planted in the checker of certificates, seen by false claims that pass."""

from __future__ import annotations

from tests.shared import false_claims as claims
from tests.shared.planting import Slip

SEEN = "proof/test_false_claims.py::test_false_claims_are_refused"
CHECKER = "parts.proof.checker"


def slip(module: str, right: str, wrong: str, check: object) -> Slip:
    return Slip(f"{CHECKER}.{module}", right, wrong, check, SEEN)  # type: ignore[arg-type]


SLIPS = (
    slip(
        "mechanism",
        "within = gap <= length * length and length >= 0",
        "within = gap <= 1",
        claims.zero_bounds,
    ),
    slip("counts", 'need(not real, "modes"', 'need(True, "modes"', claims.modes_left_out),
    slip("counts", "new = box and not any(", "new = box or any(", claims.complex_poses_twice),
    slip("paths", "first == start < to", "start < to", claims.steps_left_out),
    slip("paths", "== sorted({*numbers})", "== sorted(numbers)", claims.poses_twice),
    slip(
        "plane",
        'second * joint["ratio"] + joint["phase"] - first',
        'second * joint["ratio"] - first',
        claims.joints_with_other_numbers,
    ),
    slip("plane", ' - joint["turn"]', "", claims.joints_with_other_numbers),
    slip(
        "space",
        "for p, product in SENSES if product in products",
        "for p, product in ()",
        claims.axes_turned_round,
    ),
    slip("space", " and len(held) <= 2", "", claims.spins_of_what_is_held),
    slip(
        "crossings",
        "all(row.v == 0 for row in rows)",
        "all(abs(row.v) < 1e-9 for row in rows)",
        claims.change_points_nearly_met,
    ),
    slip("superfluous", "need(not row.factors", "need(True", claims.motions_nearly_met),
    slip(
        "boxes",
        "if alone and any(self.inside(mode, box) for mode in modes):",
        "if alone:",
        claims.modes_beside_boxes,
    ),
    slip("counts_on_curves", "count += bool(signs < 0)", "count = 1", claims.contacts_left_out),
    slip(
        "tubes",
        "if all(bool(a < r) for a, r in zip(reach, self.r, strict=True)):",
        "if reach:",
        claims.tubes_without_inverse,
    ),
)
