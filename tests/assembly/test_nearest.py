"""Exact sketches are their own mode, whole turns, modes near a limit position, modes of sets."""

from __future__ import annotations

import cmath
import json
import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import load
from tests.attack import exact_sketches, geared_counts, study_rows
from tests.shared.paths import DATA, DOCS

SKETCHES = DATA / "sketches"


def crank_slider(u: float, near: bool, rod: bool, **sketch: float) -> tuple[md.Mechanism, dict]:
    """A slider on a crank, by a bar or a rod, with a slotted lever on it: its sketch is exact."""
    a, length, E = (0.47, 1.17, 0.63 - 0.07j) if not rod else (0.67, 1.04, 1.59 + 1.53j)
    B = a * cmath.exp(1j * u)
    root = math.sqrt(length**2 - B.imag**2)
    C = B.real - root if near else B.real + root
    pose = {"crank": u, "guide": C, "lever": cmath.phase(C - E), "slot": abs(C - E)}
    bodies = [
        md.Body("crank", {"A": (0, 0), "B": (a, 0)}),
        md.Body("slider", {"C": (0, 0)}),
        md.Body("lever", {"E": (0, 0)}),
    ]
    joints = [
        md.Revolute("A", "ground.A", "crank.A"),
        md.Prismatic("guide", "ground.A", "slider.C"),
        md.Revolute("E", "ground.E", "lever.E"),
        md.PinInSlot("slot", "lever.E", "slider.C"),
    ]
    if rod:
        pose["rod"] = cmath.phase(C - B)
        bodies.insert(1, md.Body("rod", {"B": (0, 0), "C": (length, 0)}))
        joints += [md.Revolute("B", "crank.B", "rod.B"), md.Revolute("C", "rod.C", "slider.C")]
    else:
        joints.append(md.Distance("bar", "crank.B", "slider.C", length=length))
    ground = md.Ground({"A": (0, 0), "E": (E.real, E.imag)})
    mechanism = md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=pose | sketch)
    return mechanism, pose


@pytest.mark.parametrize("rod", [False, True])
@pytest.mark.parametrize("near", [False, True])
@pytest.mark.parametrize("u", [0.4, 2.1, 3.65, 5.5])
def test_a_slide_of_a_later_group_does_not_count_before_it(u, near, rod):
    """A slot of the lever, which comes later, said nothing about the slider; it was compared."""
    mechanism, pose = crank_slider(u, near, rod)
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=[u])))
    assert result.joints["guide"].slide[0] == pytest.approx(pose["guide"], abs=1e-12)
    assert result.bodies["lever"].angle[0] == pytest.approx(pose["lever"], abs=1e-12)
    assert not result.summary.get("notes")


def test_what_is_known_later_chooses_what_comes_before():
    """The sketch is silent about the slider, and its lever is on one side or the other."""
    for near in (False, True):
        mechanism, pose = crank_slider(0.9, near, rod=False)
        sketch = {name: pose[name] for name in ("crank", "lever", "slot")}
        short = md.Mechanism(
            ground=mechanism.ground,
            bodies=mechanism.bodies,
            joints=mechanism.joints,
            sketch=sketch,
        )
        result = md.solve(short, md.Sweep(md.Driver("crank.angle", at=[0.9])))
        assert result.joints["guide"].slide[0] == pytest.approx(pose["guide"], abs=1e-12)


def test_two_drivers():
    """Four bodies closed by distances and a slot: the sketch is a pose to rounding."""
    problem = load(SKETCHES / "two-drivers.toml")
    result = md.solve(problem, "t")
    for name in ("b0", "b1", "b2", "b3"):
        sketched = problem.mechanism.sketch[name]
        assert result.bodies[name].angle[0] == pytest.approx(sketched, abs=1e-9)


@pytest.mark.parametrize("name", ["angles-do-not-tell", "gear-held-by-a-point"])
def test_a_hint_that_helps(name):
    """All angles and slides are sketched and the modes differ in none of them."""
    problem = load(SKETCHES / f"{name}.toml")
    with pytest.raises(md.MechanismError, match="which assembly mode") as caught:
        md.solve(problem, "t")
    said = dict(
        line.split(" = ")
        for line in caught.value.hint.partition(", like ")[2].split(", or")[0].split(" and ")
    )
    assert caught.value.hint.startswith(f"add {' and '.join(said)} to [sketch]")
    wanted = {key.strip('"'): float(value) for key, value in said.items()}
    m = problem.mechanism
    told = md.Mechanism(
        ground=m.ground, bodies=m.bodies, joints=m.joints, sketch={**m.sketch, **wanted}
    )
    result = md.solve(told, problem.tasks["t"])
    for key, value in wanted.items():
        body, point, axis = key.split(".")
        there = result.points[f"{body}.{point}"].position[0, "xy".index(axis)]
        assert there == pytest.approx(value, rel=1e-5)


def equal_poses(result):
    """Return pairs of modes whose points are at the same places."""
    rows = np.concatenate([series.position for series in result.points.values()], axis=1)
    count = range(len(rows))
    return [(i, j) for i in count for j in range(i) if np.abs(rows[i] - rows[j]).max() < 1e-9]


def test_turns_that_leave_the_belt_unchanged_give_no_second_mode():
    """b0 a turn back, b1 one and b3 two ahead: k3 - k0 = 1.5 (k1 - k0) still holds."""
    result = md.solve(load(SKETCHES / "belt-on-carrier.toml"), "t")
    assert (result.summary["count"], result.summary["proven"]) == (8, True)
    assert equal_poses(result) == []
    assert set(result.status) == {"ok"}


def two_links(x: float) -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0)}),
        bodies=[
            md.Body("s", {"C": (0, 0)}),
            md.Body("b1", {"A": (0, 0), "B": (1, 0)}),
            md.Body("b2", {"B": (0, 0), "C": (1, 0)}),
        ],
        joints=[
            md.Prismatic("g", "ground.A", "s.C"),
            md.Revolute("A", "ground.A", "b1.A"),
            md.Revolute("B", "b1.B", "b2.B"),
            md.Revolute("C", "b2.C", "s.C"),
        ],
        sketch={"b1": 0.1, "b2": -0.1, "g": x},
    )


@pytest.mark.parametrize("steps", [1, 8, 1000])
def test_modes_next_to_a_limit_position(steps):
    """Two links of length 1 whose ends are 2 - steps/2^52 apart: +-acos(x/2) of each."""
    x = 2 - steps * 2.0**-52
    result = md.solve(two_links(x), md.Modes(md.Driver("g.slide", at=[x])))
    half = 2 * math.asin(math.sqrt((2 - x) / 4))  # 1 - cos(half) = (2 - x)/2
    assert (result.summary["count"], result.summary["proven"]) == (2, True)
    found = np.sort(result.bodies["b1"].angle)
    assert found == pytest.approx([-half, half], rel=0.3, abs=0)
    assert set(result.status) <= {"ok", "singular"}


def test_the_limit_position_itself_is_one_mode_without_a_certificate():
    result = md.solve(two_links(2.0), md.Modes(md.Driver("g.slide", at=[2.0])))
    assert result.summary["count"] == 1
    assert list(result.status) == ["singular"]
    assert np.isnan(result.bound.angle).all()
    assert "not certified" in result.summary["notes"][0]


@pytest.mark.parametrize("c", [1e-5, 1e-6, 3e-7, 1e-7])
def test_a_tiny_rocker_has_two_poses_far_apart(c):
    """They are acos(0.3) on both sides of the line to the crank's pin, nearly."""
    B = cmath.exp(1j)
    b = abs(B - 2) + 0.3 * c
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (2, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (1, 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (b, 0)}),
            md.Body("rocker", {"D": (0, 0), "C": (c, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch={"crank": 1.0},
    )
    result = md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[1.0])))
    assert (result.summary["count"], result.summary["proven"]) == (2, True)
    share = (abs(B - 2) ** 2 + c * c - b * b) / (2 * abs(B - 2) * c)
    # b has been rounded to 2e-16, which is 2e-16/c of the cosine
    wanted = [cmath.phase(B - 2) + s * math.acos(share) for s in (1, -1)]
    for angle in result.bodies["rocker"].angle:
        off = min(abs(math.remainder(angle - w, 2 * math.pi)) for w in wanted)
        assert off < 1e-15 / c
    gap = result.points["coupler.C"].position - result.points["rocker.C"].position
    assert np.abs(gap).max() < 1e-9 * c + 1e-15


def test_each_mode_has_a_bound():
    result = md.solve("geared-five-bar", "modes")
    assert set(result.status) == {"ok"}
    assert np.all((result.bound.angle > 0) & (result.bound.angle < 1e-12))
    assert np.all((result.bound.length > 0) & (result.bound.length < 1e-12))


# -- random mechanisms, samples of the scripts -------------------------------------------------

EXACT = [(0, "dyads"), (3, "geared"), (293, "geared"), (605, "geared"), (1589, "geared")]


@pytest.mark.parametrize(("seed", "family"), EXACT)
def test_exact_sketches(seed, family):
    """The last three had answers elsewhere: a wheel on a rack, a carrier's turn, a third of one."""
    answers = exact_sketches.examine(seed, family)
    assert set(answers) <= set(exact_sketches.RIGHT)


@pytest.mark.parametrize("seed", range(3000, 3030, 2))
def test_no_mode_is_nearer_to_a_rough_sketch(seed):
    assert set(exact_sketches.rough(seed, "dyads")) <= {"nearest"}


@pytest.mark.parametrize("seed", [5, 17, 29, 35, 63, 87])
def test_geared_counts(seed):
    found = geared_counts.counted(seed)
    assert found is None or found[2] == []


PLATFORMS = [7543, 10545]
"""Platforms on three legs with a rack behind them: further turns are further modes."""


@pytest.mark.parametrize("seed", PLATFORMS)
def test_platforms_with_endless_turns_are_not_proven(seed):
    count, proven, wrong = geared_counts.counted(seed)
    assert (count, proven, wrong) == (4, False, [])


def test_rows_of_studies():
    rows, together, faults = study_rows.compared(2, most=12)
    assert (rows, faults) == (12, [])
    assert together > 6


def test_figures_of_the_page_are_those_measured():
    root = DOCS
    names = ("exact-sketches", "geared-counts", "study-rows")
    exact, geared, rows = (json.loads((root / f"data/{n}.json").read_text()) for n in names)
    page = (root / "theory/evidence/honesty.md").read_text(encoding="utf-8")
    assert (exact["wrong"], geared["wrong"], rows["faults"]) == ([], [], [])
    answers = [exact["answers"][word] for word in ("own", "own by the hint")]
    assert f"of {exact['mechanisms']} mechanisms | {exact['sketches']} |" in page
    assert f"after the hint | {answers[0]}, {answers[1]} |" in page
    assert f"| {geared['mechanisms']}, {geared['modes']}, {geared['proven']} |" in page
    assert f"of these computed together | {rows['rows']}, {rows['together']} |" in page


# -- planted mistakes --------------------------------------------------------------------------


def group_by_group(monkeypatch):
    """The old rule: each group for itself, all that names its bodies compared at once."""
    from mechdae.motion.assembly.nearest_mode import Sketched

    def square(self, stage, x, u):
        own = set(self.groups[stage].bodies)
        near = [e for e in self.entries if own & set(self.bodies(e.coordinate))]
        return sum(entry.gap(x, u, self.assembler.p) ** 2 for entry in near)

    monkeypatch.setattr(Sketched, "_square", square)
    monkeypatch.setattr(Sketched, "_parts", lambda self, stages: [[k] for k in stages])


def test_the_old_distance_is_seen(monkeypatch):
    group_by_group(monkeypatch)
    mechanism, pose = crank_slider(3.65, near=True, rod=False)
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=[3.65])))
    assert abs(result.bodies["lever"].angle[0] - pose["lever"]) > 0.1


def test_turns_body_by_body_are_seen(monkeypatch):
    """Periods of each angle alone in place of the lattice of all of them."""
    from mechdae.motion.cases.meshes import turn_lattice
    from mechdae.motion.cases.meshes.turn_lattice import Lattice

    def alone(lattice, periods):
        turns = [round(period / (2 * math.pi)) for period in periods]
        rows = [[t * (i == j) for i in range(len(turns))] for j, t in enumerate(turns) if t]
        return Lattice(rows, len(turns))

    monkeypatch.setattr(turn_lattice, "with_periods", alone)
    result = md.solve(load(SKETCHES / "belt-on-carrier.toml"), "t")
    assert len(equal_poses(result)) == 8


@pytest.mark.parametrize("seed", PLATFORMS)
def test_a_platform_whose_turns_are_forgotten_is_seen(monkeypatch, seed):
    """The old rule: the poses of the platform itself are proven, whatever hangs on its turns."""
    from mechdae.motion.assembly.group_search import GroupSearch

    def forgotten(self, *given):
        self.turns.endless = [False] * len(self.turns.endless)
        return right(self, *given)

    right = GroupSearch.of_whole
    monkeypatch.setattr(GroupSearch, "of_whole", forgotten)
    assert "a pose is missing" in geared_counts.counted(seed)[2][0]


def test_modes_merged_near_a_limit_are_seen(monkeypatch):
    from mechdae.motion.assembly.elimination import BlockSolver

    monkeypatch.setattr(BlockSolver, "_near_fold", lambda self, g, m, middle, half: (middle, 0, 1))
    x = 2 - 8 * 2.0**-52
    result = md.solve(two_links(x), md.Modes(md.Driver("g.slide", at=[x])))
    assert result.summary["count"] == 1


def test_sets_on_the_mode_of_the_first_are_seen(monkeypatch):
    from mechdae.design.studies.batches.modes import StartingModes

    def first(self, numbers, u):
        starts = right(self, numbers, u)
        sign = starts.sign[np.zeros(len(u), int)]
        return replace(starts, x=self.form.poses(u[:, None], sign, numbers.p)[0], sign=sign)

    right = StartingModes.__call__
    monkeypatch.setattr(StartingModes, "__call__", first)
    assert study_rows.compared(2, most=12)[2]


def test_a_pose_that_a_group_gives_twice_is_one(monkeypatch):
    from mechdae.motion.assembly.assembler import Assembler

    task = md.Sweep(md.Driver("A.angle", at=[0.3]))
    once = md.solve(md.load("rssr").mechanism, task)
    right = Assembler.candidates

    def twice(self, *given, **keys):
        poses, *rest = right(self, *given, **keys)
        return [pose.copy() for pose in poses for _ in range(2)], *rest

    monkeypatch.setattr(Assembler, "candidates", twice)
    again = md.solve(md.load("rssr").mechanism, task)
    assert np.array_equal(again.bodies["rocker"].orientation, once.bodies["rocker"].orientation)
