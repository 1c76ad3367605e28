"""The truth about random mechanisms is checked by itself, without the package's numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.reference.truth.drawing import FAMILIES, draw
from tests.reference.truth.labels import Poses
from tests.reference.truth.series import CLD, LD
from tests.reference.truth.unclosed import SYSTEMS


class Closed(Poses):
    """Bodies of a closed world, in 80 bits, for the joints' equations by their definitions."""

    def __init__(self, case, world, row):
        self.mechanism = case.mechanism()
        self.values = self.mechanism.values()
        self.where, self.angle = {}, {"ground": LD(0)}
        for body in case.bodies:
            first = next(iter(self.mechanism.bodies[body].points))
            self.where[body] = (first, world.place((body, first)).c[0][row])
            self.angle[body] = world.angle(body).c[0][row].real

    def local(self, body, point):
        x, y = (self.values[f"{body}.{point}.{axis}"] for axis in "xy")
        return CLD(LD(x)) + 1j * CLD(LD(y))

    def place(self, reference, moved):
        body, point = reference.split(".")
        if body == "ground":
            return self.local(body, point)
        first, place = self.where[body]
        arm = self.local(body, point) - self.local(body, first)
        return place + arm * np.exp(1j * CLD(self.angle[body]))


@pytest.mark.parametrize("family", FAMILIES)
def test_closures_meet_the_equations_of_the_joints(family):
    """Wherever an element is said to close, all joints do, by their definitions."""
    for seed in range(3):
        case = draw(seed, family)
        case.survey(case.s0 - 1 * case.unit, case.s0 + 1 * case.unit)
        low = max(float(e.reach[0].at) for e in case.elements)
        high = min(float(e.reach[1].at) for e in case.elements)
        ends = max(low, case.s0 - case.unit), min(high, case.s0 + case.unit)
        u = ends[0] + (ends[1] - ends[0]) * np.array([0.001, 0.2, 0.5, 0.8, 0.999])
        world = case.close(u)
        for row in range(len(u)):
            poses = Closed(case, world, row)
            size = max(case.size, *(abs(complex(place)) for _, place in poses.where.values()))
            for joint in poses.mechanism.joints.values():
                *rows, last = [float(r) for r in poses.residual(joint, {})]
                if joint.kind in ("prismatic", "weld"):  # an angle, whole turns aside
                    last = math.remainder(last, 2 * math.pi) * size
                elif joint.kind in ("gear", "belt"):
                    last *= size
                allowed = 1e-15 * max(30.0, abs(case.s0)) * size  # angles in 53 bits
                assert max(map(abs, [*rows, last])) < allowed, (case.seed, joint)


def test_the_whole_mechanism_goes_as_far_as_one_continuation_of_it():
    """All elements are closed at once, place after place from the sketch, until one is open."""
    ended = 0
    for seed in range(12):
        case = draw(seed, "parallel")
        case.survey(case.s0 - 4 * case.unit, case.s0 + 4 * case.unit)
        for sense, end in zip((-1, 1), case.whole(), strict=True):
            step = 2e-3 * case.unit
            u = case.s0 + sense * step * np.arange(2000)
            world = case.close(u, wide=False)
            open_ = np.zeros(len(u), bool)
            for element, disc in zip(case.elements, world.discs, strict=True):
                if disc is not None:
                    value = disc.c[0].real
                    open_ |= ~(value > 0)
                    if element.kind == "prp":  # the sine of the angle of its guides, squared
                        sine = np.sqrt(value)
                        open_ |= sine <= 1.01 * np.abs(np.gradient(sine))
            first = u[np.argmax(open_)] if open_.any() else sense * np.inf
            if np.isfinite(float(end.at)) and abs(float(end.at) - case.s0) < 3.9 * case.unit:
                assert abs(first - float(end.at)) < 3 * step, (seed, end)
                ended += 1
            else:
                assert abs(first - case.s0) > 3.8 * case.unit, (seed, end)
    assert ended > 8


@pytest.mark.parametrize(
    ("family", "seed"), [("triads", 0), ("triads", 2), ("geared", 1), ("exact", 2), ("gears", 1)]
)
def test_rates_are_the_differences_of_positions(family, seed):
    case = draw(seed, family)
    case.survey(case.s0 - 0.1 * case.unit, case.s0 + 0.1 * case.unit)
    h = LD(1e-4 * case.unit)
    u = LD(case.s0) + h * np.arange(-2, 3).astype(LD)
    world = case.close(u, 2)
    for body in case.bodies:
        for point in case.local[body]:
            value, first, second = world.place((body, point)).derivatives
            slope = (value[0] - 8 * value[1] + 8 * value[3] - value[4]) / (12 * h)
            bend = (-value[0] + 16 * value[1] - 30 * value[2] + 16 * value[3] - value[4]) / (
                12 * h * h
            )
            size = case.scale / case.unit
            assert abs(slope - first[2]) < 1e-9 * max(size, abs(first[2])), (body, point)
            assert abs(bend - second[2]) < 1e-6 * max(size / case.unit, abs(second[2]))


@pytest.mark.parametrize("seed", range(10))
def test_tracks_are_among_all_roots(seed):
    """The root that is followed is one of those of the elimination, and a fold loses two."""
    case = draw(seed, "triads", count=1)
    case.survey(case.s0 - 2 * case.unit, case.s0 + 2 * case.unit)
    element = case.elements[1]

    def roots(u):
        world = case.close([u], upto=1)
        return SYSTEMS["triad"](world, element).all_roots()

    low, high = (float(end.at) for end in element.reach)
    inside = max(low, case.s0 - 2 * case.unit), min(high, case.s0 + 2 * case.unit)
    seen = 0  # not where roots are near each other
    for share in (0.03, 0.3, 0.55, 0.8, 0.97):
        u = inside[0] + share * (inside[1] - inside[0])
        world = case.close([u])
        origin = complex(world.place((element.data["body"], "p0")).c[0][0])
        found = roots(u)
        if found:
            seen += 1
            assert min(abs(origin - complex(x, y)) for x, y, _ in found) < 1e-12 * case.size
    assert seen > 2
    for end, sense in zip(element.reach, (-1, 1), strict=True):
        if end.kind != "limit" or end.owner != 1 or abs(float(end.at) - case.s0) > 2 * case.unit:
            continue
        before, behind = (roots(float(end.at) + sense * d * case.unit) for d in (-1e-4, 1e-4))
        if before is not None and behind is not None:
            assert len(before) == len(behind) + 2


def test_closed_forms_through_change_points():
    """Away from the crossing the form through it is the general one, on the branch it is on."""
    for seed in range(8):
        case = draw(seed, "exact")
        case.survey(case.s0 - 4, case.s0 + 4)
        u = case.s0 + np.linspace(-3, 3, 11)
        u = u[[all(abs(s - float(c)) > 0.05 for c in case.elements[1].crossings) for s in u]]
        u = u[(u > float(case.elements[1].reach[0].at)) & (u < float(case.elements[1].reach[1].at))]
        world = case.close(u, 2, upto=2)
        general = case.shaken(np.random.default_rng(0)).close(u, 2, upto=2)
        for body in case.elements[1].bodies:
            for one, two in zip(world.direction(body).c, general.direction(body).c, strict=True):
                assert np.abs(one - two).max() < 1e-11
