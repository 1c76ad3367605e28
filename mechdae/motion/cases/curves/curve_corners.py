"""Rates at the corners of curves: where there are two values, none is reported.

Where a curve is made of pieces (`min`, `max`, `abs`) or closes with another derivative than it
begins with, a derivative of some order jumps. A pose whose contact is there within its error
has no rates from that order on; of a roller, which hangs on the tangent, from one order before.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.describe.joints.curve import PARAMETER
from mechdae.equations.cases.curve_contacts import Contact, place
from mechdae.equations.model import FUNCTIONS
from mechdae.equations.reduction import Scene
from mechdae.kernels.graphs.driver_curve import DriverCurve
from mechdae.kernels.run.functions import Batch
from mechdae.motion.continuation.evaluate import Evaluator, Poses
from mechdae.motion.kinematics.finds import named_poses
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.types import Floats, Integers

ORDERS = 3
SAMPLES = 257
"""Places of a curve at which the sizes of its derivatives are taken."""
SAME = 1e-9
"""Share of the largest derivative within which those of two sides are the same."""
NEAR = 64 * np.finfo(float).eps


def without_two_values(setting: Setting, run: Run) -> None:
    """Take the rates that have two values from the poses of a run, with a note."""
    scene = setting.scene
    for name, contact in scene.model.contacts.items():
        group = next((g for g in scene.groups if name in g.joints), None)
        if group is None or not contact.pieces:
            continue
        order = CurvePieces(scene, contact).orders(run.poses, run.values)
        lost = _hide(run.evaluator, run.poses, group.index, order)
        if lost.size:
            setting.notes.append(
                f"joint {name}: poses at corners of the curve, {named_poses(setting, run, lost)}: "
                "rates that differ on the two sides are not given"
            )


def _hide(evaluator: Evaluator, poses: Poses, group: int, order: Integers) -> Integers:
    """Write nan over rates that depend on a group; return the numbers of those poses."""
    after = evaluator.graphs.scene.hanging(group)
    columns = np.array(
        [
            column
            for entry, groups in evaluator.entry_groups
            if any(evaluator.groups[j] in after for j in groups)
            for column in entry.columns
        ],
        int,
    )
    lost = np.zeros(len(order), bool)
    for k, rates in enumerate(poses.y[1:], start=1):
        rows = np.flatnonzero(order <= k)
        if rows.size and columns.size:
            lost[rows] |= np.isfinite(rates[np.ix_(rows, columns)]).any(axis=1)
            rates[np.ix_(rows, columns)] = np.nan
    return np.flatnonzero(lost)


class CurvePieces:
    """A curve with the places at which one of its derivatives jumps."""

    def __init__(self, scene: Scene, contact: Contact) -> None:
        self.contact, self.scene = contact, scene
        s = ca.SX.sym("s")
        known = {**scene.model.mechanism.values(), PARAMETER: s}
        self.course: DriverCurve = DriverCurve(s, place(contact.joint, known, FUNCTIONS))

    def orders(self, poses: Poses, drivers: Floats) -> Integers:
        """Return the lowest order of the rates that have two values at each pose, (n,) ints."""
        s, reach = self._places(poses, drivers)
        found = np.full(len(s), ORDERS + 1)
        low, high = self.contact.range
        sizes = [
            float(np.nanmax(np.abs(part), initial=0.0))
            for part in self.course.sampled(np.linspace(low, high, SAMPLES), ORDERS)
        ]
        known = np.flatnonzero(np.isfinite(s))
        beside = [self._inside(s[known] + way * reach[known]) for way in (-1, 1)]
        sides = [self.course.sides(places) for places in beside]
        turning = (sides[0] != sides[1]).any(axis=1)
        if self.contact.wrapped:  # where the curve closes
            turning |= np.abs(beside[1] - beside[0]) > 4 * reach[known]
        for i in np.flatnonzero(turning):
            k = known[i]
            here = self._inside(s[k : k + 1])
            left, right = (
                self.course.one_sided(places[i], side[i])
                for places, side in zip(beside, sides, strict=True)
            )
            tie = self.course.one_sided(here[0], self.course.sides(here)[0])
            for order in range(1, ORDERS + 1):
                gaps = np.abs([left[order] - right[order], tie[order] - right[order]])
                if not np.all(gaps <= SAME * sizes[order]):
                    found[k] = max(1, order - 1) if self.contact.rolls else order
                    break
            else:  # a roller's third rate hangs on the fourth derivative, which is not compared
                found[k] = ORDERS + (not self.contact.rolls)
        return found

    def _inside(self, s: Floats) -> Floats:
        """Return places of a curve that is repeated within its range."""
        if not self.contact.wrapped:
            return s
        low, high = self.contact.range
        return low + np.remainder(s - low, high - low)

    def _places(self, poses: Poses, drivers: Floats) -> tuple[Floats, Floats]:
        """Return s of the contact at each pose and how far it may be off, (n,) both."""
        scene, p = self.scene, self.scene.model.p_values
        expression = scene.expression(self.contact.s)
        function = ca.Function("s", [scene.x, scene.u, scene.model.p], [expression])
        s = Batch(function, shared=[2])(poses.x, drivers, p)[0][:, 0]
        owner = (self.contact.joint.name, "s")
        error = 0.0
        if owner in scene.x_names:
            error = np.nan_to_num(poses.error[:, scene.x_names.index(owner)])
        width = self.contact.range[1] - self.contact.range[0]
        return s, 2 * error + NEAR * np.maximum(np.abs(s), width)
