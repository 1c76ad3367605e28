"""Triads, and groups of the same truss, against scans of their own."""

from __future__ import annotations

import cmath
import itertools
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.motion.assembly.platform import Leg, closures, real_roots
from tests.reference.three_legs import KINDS, Condition, Platform, scan
from tests.shared.mechanisms import four_bar

EVERY = list(itertools.combinations_with_replacement(KINDS, 3))


def modes(mechanism: md.Mechanism, driver: str, at: float) -> md.Result:
    return md.solve(mechanism, md.Modes(md.Driver(driver, at=[at])))


def poses(result: md.Result, body: str = "plate", point: str = "Z") -> np.ndarray:
    """Return (w, z) of a body in all modes, (k, 2), sorted."""
    if not len(result):
        return np.zeros((0, 2), complex)
    z = result.points[f"{body}.{point}"].position @ [1, 1j]
    found = np.stack([np.exp(1j * result.bodies[body].angle), z], axis=1)
    return found[np.argsort(np.angle(found[:, 0]))]


def agree(found: np.ndarray, wanted: list, size: float, tolerance: float = 1e-10) -> bool:
    """Return whether two sets of poses are the same."""
    if len(found) != len(wanted):
        return False
    scale = np.array([1, 1 / size])
    gaps = [
        min(np.abs((row - [np.exp(1j * phi), z]) * scale).max() for row in found)
        for phi, z in wanted
    ]
    return max(gaps, default=0.0) < tolerance


# -- the six modes of the reference --------------------------------------------------------------

PHI = [
    -0.98697425786831852,
    -0.047331384127091309,
    0.24530938278924670,
    0.58567315601736242,
    1.00203864903020856,
    2.13290445327533053,
]
LABELS = ["-1", "+1", "+2", "-2", "-3", "+3"]
TOUCH_R, TOUCH_U, TOUCH_PHI = 2.973138833088139466818, -0.7014740924680994407721, 0.47518278419309
"""Crank's length and angle at which modes +2 and -2 touch (leg equations with vanishing
determinant and vanishing push of the driver, 45 digits)."""
LIMIT = -0.63761592285824115
"""Where modes +2 and -2 end for a crank of 3 (45 digits)."""


def test_six_of_six_with_their_labels() -> None:
    result = md.solve("triad-six-modes", "modes")
    assert (result.summary["count"], result.summary["proven"]) == (6, True)
    order = np.argsort(result.bodies["platform"].angle)
    assert result.bodies["platform"].angle[order] == pytest.approx(PHI, abs=1e-13)
    assert [result.labels[k] for k in order] == [(label,) for label in LABELS]


@pytest.mark.parametrize("label", LABELS)
def test_a_mode_asked_for_by_its_label_starts_there(label: str) -> None:
    problem = md.load("triad-six-modes")
    result = md.solve(problem, replace(problem.tasks["turn"], poses=9), mode=label)
    assert result.summary["mode"] == label
    angle = result.bodies["platform"].angle[0]
    assert abs(cmath.exp(1j * angle) - cmath.exp(1j * PHI[LABELS.index(label)])) < 1e-12


def test_modes_on_both_sides_of_a_limit() -> None:
    problem = md.load("triad-six-modes").mechanism
    for inside, count in ((1e-3, 6), (1e-6, 6), (-1e-6, 4), (-1e-3, 4)):
        result = modes(problem, "crank.angle", LIMIT + inside)
        assert (result.summary["count"], result.summary["proven"]) == (count, True), inside


def test_modes_too_near_to_each_other_are_not_proven() -> None:
    mechanism = md.load("triad-six-modes").mechanism
    for distance in (1e-14, 0.0, -1e-14):
        result = modes(mechanism, "crank.angle", LIMIT + distance)
        assert not result.summary["proven"]
        assert result.summary["count"] in (5, 6)


def platform_at(r: float, u: float) -> list[Condition]:
    """Return the legs of `triad-six-modes` as conditions."""
    m3 = 20.84 * cmath.exp(0.882603j)
    tip = complex(-r, 10) + r * cmath.exp(1j * u)
    return [
        Condition("circle", 0, 0, 14.98),
        Condition("circle", 15.91, 17.04, 15.38),
        Condition("circle", tip, m3, 12.0),
    ]


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-8])
def test_a_sweep_past_a_near_collision_stays_on_its_branch(short: float) -> None:
    r = TOUCH_R * (1 - short)
    problem = md.load("triad-six-modes").with_values({"r": r})
    near = TOUCH_U + np.array([-1e-2, 0.0, 1e-2])
    pair = []
    for label in ("+2", "-2"):
        task = md.Sweep(md.Driver("crank.angle", at=[0.0, *near, 2 * np.pi]))
        result = md.solve(problem, task, mode=label)
        assert set(result.status) == {"ok"}
        angle = result.bodies["platform"].angle
        assert angle[-1] == pytest.approx(angle[0], abs=1e-11)
        pair.append(angle[1:-1])
    for u, low, high in zip(near, *pair, strict=True):
        span = (TOUCH_PHI - 0.05, TOUCH_PHI + 0.05)
        known = [phi for phi, _ in scan(platform_at(r, u), 5000, span)]
        assert (low, high) == pytest.approx(sorted(known), abs=1e-9)
        assert low < TOUCH_PHI < high


def test_branches_that_touch_are_crossed() -> None:
    """The rounded radius keeps them apart by less than its rounding: what follows is not sure."""
    problem = md.load("triad-six-modes").with_values({"r": TOUCH_R})
    task = md.Sweep(md.Driver("crank.angle", from_=0.0, to=2 * np.pi), poses=13)
    result = md.solve(problem, task, mode="+2")
    (event,) = result.events
    assert (event["kind"], event["exact"]) == ("change_point", False)
    assert event["at"] == pytest.approx(TOUCH_U + 2 * np.pi, abs=1e-11)
    behind = result.drivers["crank.angle"].position > event["at"]
    assert set(result.status[~behind]) == {"ok"}
    assert set(result.status[behind]) == {"ambiguous"}
    angle = result.bodies["platform"].angle
    assert angle[[0, -1]] == pytest.approx([PHI[2], PHI[3]], abs=0.01)


# -- every combination of legs ---------------------------------------------------------------------


@pytest.mark.parametrize("kinds", EVERY, ids=lambda kinds: "-".join(kinds).replace(" ", "_"))
def test_all_modes_against_a_scan(kinds) -> None:
    random = np.random.default_rng([2, *map(KINDS.index, kinds)])
    drawn = Platform(random.permutation(kinds), random)
    result = modes(drawn.mechanism(), "idle.angle", 0.4)
    known = scan(drawn.conditions)
    assert result.summary["proven"]
    assert agree(poses(result), known, drawn.size)
    assert min(abs(np.exp(1j * phi) - drawn.w0) for phi, _ in known) < 1e-12


@pytest.mark.parametrize(
    "kinds", [("RR", "RR", "RR"), ("RP", "RR", "PR"), ("RP", "plate slot", "ground slot")]
)
def test_units_and_order_do_not_matter(kinds) -> None:
    reference, labels = None, None
    for size in (1e-6, 1.0, 1e3):
        drawn = Platform(kinds, np.random.default_rng(5), size)
        result = modes(drawn.mechanism(), "idle.angle", 0.4)
        found = poses(result) / [1, size]
        reference = found if reference is None else reference
        labels = labels or result.labels
        assert result.summary["proven"]
        assert result.labels == labels
        assert found == pytest.approx(reference, abs=1e-12)
        for seed in range(3):
            shuffled = drawn.mechanism(np.random.default_rng(seed))
            assert poses(modes(shuffled, "idle.angle", 0.4)) / [1, size] == pytest.approx(
                reference, abs=1e-12
            )


def test_legs_that_do_not_meet_say_by_how_much() -> None:
    drawn = Platform(["distance"] * 3, np.random.default_rng(1))
    mechanism = drawn.mechanism()
    for length in (0.3, 0.03):
        short = {j.name: replace(j, length=length) for j in drawn.joints}
        assert scan([replace(c, length=length) for c in drawn.conditions]) == []
        joints = {**mechanism.joints, **short}
        result = modes(replace(mechanism, joints=joints), "idle.angle", 0.4)
        assert (result.summary["count"], result.summary["proven"]) == (0, True)
        assert "stays open by" in result.fault


# -- motion ----------------------------------------------------------------------------------------

CRANK = 0.4


def driven(kinds, seed: int):
    """Return a platform whose first leg stands on a crank, and its conditions by the angle.

    The mechanism closes as drawn for a crank angle of zero.
    """
    drawn = Platform(["RR", *kinds], np.random.default_rng(seed))
    mechanism = drawn.mechanism()
    pivot = complex(*drawn.points["P1"])
    ground = {**mechanism.ground.points, "O": ((pivot - CRANK).real, pivot.imag)}
    crank = md.Body("idle", {"O": (0, 0), "A": (CRANK, 0)})
    joints = dict(mechanism.joints)
    old = joints["J1"]
    ends = [end.replace("ground.P1", "idle.A") for end in (old.first, old.second)]
    joints["J1"] = md.Revolute("J1", *ends)
    bodies = {**mechanism.bodies, "idle": crank}
    sketch = {"idle": 0.0, "plate": drawn.phi0}
    built = replace(
        mechanism, ground=md.Ground(ground), bodies=bodies, joints=joints, sketch=sketch
    )

    def conditions(u: float) -> list[Condition]:
        tip = pivot - CRANK + CRANK * np.exp(1j * np.clongdouble(u))
        return [replace(drawn.conditions[0], b=tip), *drawn.conditions[1:]]

    return built, conditions


def fold(conditions, z: complex, phi: float, u: float) -> float:
    """Return the crank angle of a limit position: Newton's method with 80-bit differences."""
    long = np.longdouble

    def legs(y):
        w, place = np.exp(1j * np.clongdouble(y[2])), np.clongdouble(y[0] + 1j * y[1])
        return np.array([c.miss(place, w) for c in conditions(y[3])])

    def slope(function, y, columns):
        steps = [long(1e-6) * (np.arange(4) == k) for k in range(columns)]
        return np.stack([(function(y + h) - function(y - h)) / long(2e-6) for h in steps], axis=-1)

    def system(y):
        a, b, c = slope(legs, y, 3)
        return np.append(legs(y), np.dot(a, np.cross(b, c)))

    y = np.array([z.real, z.imag, phi, u], long)
    for _ in range(12):
        y = y - np.linalg.solve(slope(system, y, 4).astype(float), system(y).astype(float))
    return float(y[3])


@pytest.mark.parametrize(
    ("kinds", "seed"),
    [
        (("RR", "RR"), 2),
        (("PR", "RR"), 2),
        (("RP", "distance"), 0),
        (("PR", "RP"), 5),
        (("plate slot", "ground slot"), 5),
    ],
)
def test_motion_of_a_triad_and_its_limits(kinds, seed: int) -> None:
    mechanism, conditions = driven(kinds, seed)
    task = md.Sweep(md.Driver("idle.angle", range="assembled"), poses=9)
    result = md.solve(mechanism, task)
    assert set(result.status) == {"ok", "limit"}
    found = poses_along(result)
    values = result.drivers["idle.angle"].position
    for u, pose in zip(values[1:-1], found[1:-1], strict=True):
        known = [(np.exp(1j * phi), z) for phi, z in scan(conditions(u))]
        assert min(max(abs(pose[0] - w), abs(pose[1] - z)) for w, z in known) < 1e-10
    assert values[0] < 0 < values[-1]
    for limit, (w, z) in ((values[0], found[0]), (values[-1], found[-1])):
        assert limit == pytest.approx(fold(conditions, z, np.angle(w), limit), abs=1e-12)
        inside = limit - 1e-4 * np.sign(limit)
        outside = limit + 1e-4 * np.sign(limit)
        counts = [modes(mechanism, "idle.angle", u).summary for u in (inside, outside)]
        assert counts[0]["count"] - counts[1]["count"] == 2
        assert all(count["proven"] for count in counts)


def poses_along(result: md.Result) -> list[tuple[complex, complex]]:
    z = result.points["plate.Z"].position @ [1, 1j]
    return list(zip(np.exp(1j * result.bodies["plate"].angle), z, strict=True))


# -- special shapes ------------------------------------------------------------------------------

TRIANGLE = (0, 1, 0.4 + 0.9j)


def test_a_platform_congruent_to_its_base_is_proven() -> None:
    lengths = (1.0, 1.2, 1.1)
    found = closures([Leg(b, b, r) for b, r in zip(TRIANGLE, lengths, strict=True)])
    known = scan([Condition("circle", b, b, r) for b, r in zip(TRIANGLE, lengths, strict=True)])
    assert found.proven
    assert len(found.z) == len(known) == 4


def test_a_platform_on_parallel_legs_is_said_to_be_free() -> None:
    found = closures([Leg(b, b, 1.0) for b in TRIANGLE])
    assert found.free
    assert not found.proven
    assert len(found.z) == 2


def test_a_platform_on_parallel_guides_is_said_to_be_free() -> None:
    # at phi = 0 all three lines are parallel and it slides; elsewhere it is held
    legs = [Leg(0, 0, 0, 1j), Leg(1 + 1j, 1j, 0, 1j, True), Leg(2 - 1j, -1j, 0, 1j, True)]
    found = closures(legs)
    assert found.free
    assert not found.proven
    assert np.all(np.abs(found.z) < 100)


def test_two_poses_of_one_angle() -> None:
    # two parallel lines fix the angle at asin(1/2), the circle gives two places for each
    legs = [Leg(0, 0, 0, 1j), Leg(0.5j, 1, 0, 1j), Leg(0.3 + 0.2j, 0.5 + 0.1j, 0.9)]
    found = closures(legs)
    assert found.proven
    assert sorted(found.w.real) == pytest.approx(np.sqrt(0.75) * np.array([-1, -1, 1, 1]))
    for z, w in zip(found.z, found.w, strict=True):
        assert abs(z.imag) < 1e-15
        assert abs(z + w * (0.5 + 0.1j) - (0.3 + 0.2j)) == pytest.approx(0.9)
    # nearer than the lines allow: provably none
    none = closures([*legs[:2], Leg(0.3 + 9j, 0.5 + 0.1j, 0.9)])
    assert none.proven
    assert len(none.z) == 0


@pytest.mark.parametrize(("gap", "proven"), [(1e-4, True), (1e-16, False), (-1e-4, True)])
def test_roots_on_the_circle_are_told_from_roots_beside_it(gap: float, proven: bool) -> None:
    # cos(phi) = 1 - gap: two roots, one double root, none
    roots, _, cluster = real_roots(np.array([0.5, gap - 1, 0.5]).astype(complex), 1e-15)
    single = all(np.sum(cluster == k) == 1 for k in cluster)
    assert single == proven
    assert len(roots) == (2 if gap > 0 else 0)


def test_a_polynomial_of_noise_proves_nothing() -> None:
    for c, doubts in (([1e-14, 3e-16, 1e-14], 1), ([1e-14, 3e-9, 1e-14], 0)):
        roots, radius, _ = real_roots(np.array(c, complex), 1e-15)
        assert len(roots) == doubts
        assert np.all(radius > 1)


@pytest.mark.parametrize("carrier", ["crank.A", "leg1.A"])
def test_three_links_on_one_pin(carrier: str) -> None:
    """Two legs share the crank's pin; the second may be declared on the first leg."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "R": (4.0, 1.0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (1, 0)}),
            md.Body("leg1", {"A": (0, 0), "D": (3, 0)}),
            md.Body("leg2", {"A": (0, 0), "E": (3.5, 0)}),
            md.Body("leg3", {"R": (0, 0), "F": (2, 0)}),
            md.Body("plate", {"Z": (0, 0), "E": (1.2, 0), "F": (0.4, 2)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A1", "crank.A", "leg1.A"),
            md.Revolute("A2", carrier, "leg2.A"),
            md.Revolute("R", "ground.R", "leg3.R"),
            md.Revolute("D", "leg1.D", "plate.Z"),
            md.Revolute("E", "leg2.E", "plate.E"),
            md.Revolute("F", "leg3.F", "plate.F"),
        ],
    )
    result = modes(mechanism, "crank.angle", 0.5)
    pin = cmath.exp(0.5j)
    legs = [(pin, 0, 3.0), (pin, 1.2, 3.5), (4 + 1j, 0.4 + 2j, 2.0)]
    known = scan([Condition("circle", *leg) for leg in legs])
    assert result.summary["proven"]
    assert known
    assert agree(poses(result), known, 1.0)


# -- the same truss, another link known ----------------------------------------------------------

LINKS = {
    "T1": "A B H",
    "T2": "a b h",
    "b1": "A a",
    "b2": "B b",
    "b3": "H Q",
    "b4": "h Q",
}


def stephenson(frame: str, seed: int) -> tuple[md.Mechanism, dict[str, complex], dict[str, float]]:
    """Return Stephenson's chain with one link fixed: two ternary links, four binary ones.

    Also the places of the pins and the angles of the links at the pose it was drawn in.
    """
    random = np.random.default_rng(seed)
    pins = {name: complex(*random.normal(size=2)) for name in "ABHabhQ"}
    angle = {link: float(random.uniform(-3, 3)) for link in LINKS}
    angle[frame] = 0.0
    points = {}
    for link, names in LINKS.items():
        origin = 0 if link == frame else pins[names[0]]
        turned = {n: (pins[n] - origin) * cmath.exp(-1j * angle[link]) for n in names.split()}
        points[link] = {n: (z.real, z.imag) for n, z in turned.items()}
    name = {link: "ground" if link == frame else link for link in LINKS}
    joints = []
    for pin in pins:
        one, other = (link for link, names in LINKS.items() if pin in names.split())
        joints.append(md.Revolute(f"J{pin}", f"{name[one]}.{pin}", f"{name[other]}.{pin}"))
    bodies = [md.Body(link, points[link]) for link in LINKS if link != frame]
    return md.Mechanism(ground=md.Ground(points[frame]), bodies=bodies, joints=joints), pins, angle


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("frame", "driver", "kind", "legs"),
    [
        # the known pin Q in place of H or h, else the known distance of H and h
        ("T1", "b3.angle", "III 4 links", "Aa Bb Qh"),
        ("T2", "b4.angle", "III 4 links", "aA bB QH"),
        ("b3", "b4.angle", "IV 4 links", "Aa Bb Hh"),
        ("b4", "b3.angle", "IV 4 links", "Aa Bb Hh"),
        ("T1", "JQ.angle", "I(1,2,3,4,5)", "Aa Bb Hh"),
        ("b1", "JQ.angle", "I(1,2,3,4,5)", "Aa Bb Hh"),
    ],
)
def test_stephenson_with_any_link_fixed(frame, driver, kind, legs, seed: int) -> None:
    mechanism, pins, angle = stephenson(frame, seed)
    drawn = {link: z for link, z in angle.items() if link != frame}
    known = {"JQ": angle["b4"] - angle["b3"], **angle}
    result = modes(mechanism, driver, known[driver.removesuffix(".angle")])
    assert kind in result.summary["formula"]
    assert result.summary["proven"]
    ends = [(pins[one], pins[other]) for one, other in legs.split()]
    count = len(scan([Condition("circle", b, m, abs(b - m)) for b, m in ends]))
    assert result.summary["count"] == count
    gaps = [
        max(abs(np.exp(1j * result.bodies[n].angle[k]) - np.exp(1j * z)) for n, z in drawn.items())
        for k in range(count)
    ]
    assert min(gaps) < 1e-11


def test_a_cylinder_in_a_leg_holds_a_triad() -> None:
    """The slide of a leg is driven: barrel and rod are one link of that length."""
    m3 = 20.84 * cmath.exp(0.882603j)
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "B": (15.91, 0), "C": (0, 10)}),
        bodies=[
            md.Body("plate", {"D": (0, 0), "E": (17.04, 0), "F": (m3.real, m3.imag)}),
            md.Body("leg1", {"A": (0, 0), "D": (14.98, 0)}),
            md.Body("leg2", {"B": (0, 0), "E": (15.38, 0)}),
            md.Body("barrel", {"C": (0, 0)}),
            md.Body("rod", {"F": (0, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "leg1.A"),
            md.Revolute("B", "ground.B", "leg2.B"),
            md.Revolute("C", "ground.C", "barrel.C"),
            md.Revolute("D", "leg1.D", "plate.D"),
            md.Revolute("E", "leg2.E", "plate.E"),
            md.Revolute("F", "rod.F", "plate.F"),
            md.Prismatic("cylinder", "barrel.C", "rod.F"),
        ],
    )
    result = modes(mechanism, "cylinder.slide", 12.0)
    assert (result.summary["count"], result.summary["proven"]) == (6, True)
    assert sorted(result.bodies["plate"].angle) == pytest.approx(PHI, abs=1e-13)
    # a driven point of the plate is a leg as well: its x on a line
    free = {name: joint for name, joint in mechanism.joints.items() if name not in ("B", "E")}
    legs = {name: body for name, body in mechanism.bodies.items() if name != "leg2"}
    task = md.Modes(
        drivers=[md.Driver("cylinder.slide", at=[12.0]), md.Driver("plate.E.x", at=[5.0])]
    )
    result = md.solve(replace(mechanism, joints=free, bodies=legs), task)
    conditions = [
        Condition("circle", 0, 0, 14.98),
        Condition("circle", 10j, m3, 12.0),
        Condition("ground line", 5.0, 17.04, d=1j),
    ]
    assert result.summary["proven"]
    assert agree(poses(result, point="D"), scan(conditions), 10.0)


def test_a_driven_pin_in_a_slot() -> None:
    """Slide or angle of a slot driven: a pin, or a prismatic pair, in place of the slot."""
    drawn = Platform(["RR", "RR", "plate slot"], np.random.default_rng(3))
    mechanism = drawn.mechanism()
    swing = md.Body("swing", {"S": (0, 0), "T": (1.3, 0)})
    joints = {
        **{n: j for n, j in mechanism.joints.items() if n != "J3"},
        "foot": md.Revolute("foot", "ground.P3", "swing.S"),
        "J3": md.PinInSlot("J3", "plate.Q3", "swing.T", axis=0.4),
    }
    bodies = {**mechanism.bodies, "swing": swing}
    whole = replace(mechanism, bodies=bodies, joints=joints)
    slot = complex(*drawn.plate["Q3"])
    foot = complex(*drawn.points["P3"])
    task = md.Modes(drivers=[md.Driver("idle.angle", at=[0.4]), md.Driver("J3.slide", at=[0.5])])
    result = md.solve(whole, task)
    pin = slot + 0.5 * cmath.exp(0.4j)
    wanted = scan([*drawn.conditions[:2], Condition("circle", foot, pin, 1.3)])
    assert result.summary["proven"]
    assert wanted
    assert agree(poses(result), wanted, 1.0)
    task = md.Modes(drivers=[md.Driver("idle.angle", at=[0.4]), md.Driver("J3.angle", at=[0.7])])
    result = md.solve(whole, task)
    # the swing turns with the plate, its foot slides along the slot's direction
    local = slot - 1.3 * cmath.exp(0.7j)
    line = Condition("plate line", foot, local, d=cmath.exp(0.4j))
    wanted = scan([*drawn.conditions[:2], line])
    assert result.summary["proven"]
    assert agree(poses(result), wanted, 1.0)


# -- behind a dyad, before a gear ------------------------------------------------------------------


def behind_a_dyad() -> md.Mechanism:
    """Return a four-bar whose coupler carries one leg of a platform."""
    bar = four_bar(4, 12, 8, 10, crank=1.0, coupler=0.4, rocker=1.0)
    ground = md.Ground({**bar.ground.points, "P": (4.0, -6.0), "R": (14.0, -5.0)})
    bodies = [
        *bar.bodies.values(),
        md.Body("plate", {"D": (0, 0), "E": (7, 0), "F": (3, 5)}),
        md.Body("leg1", {"C": (0, 0), "D": (8, 0)}),
        md.Body("leg2", {"P": (0, 0), "E": (7, 0)}),
        md.Body("leg3", {"R": (0, 0), "F": (9, 0)}),
    ]
    joints = [
        *bar.joints.values(),
        md.Revolute("L1", "coupler.C", "leg1.C"),
        md.Revolute("L2", "ground.P", "leg2.P"),
        md.Revolute("L3", "ground.R", "leg3.R"),
        md.Revolute("PD", "leg1.D", "plate.D"),
        md.Revolute("PE", "leg2.E", "plate.E"),
        md.Revolute("PF", "leg3.F", "plate.F"),
    ]
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints)


def test_labels_of_a_triad_behind_a_dyad() -> None:
    mechanism = behind_a_dyad()
    result = modes(mechanism, "crank.angle", 1.0)
    assert result.summary["proven"]
    count = 0
    for sign in (1, -1):  # the two places of the coupler's end, then the platform's legs
        B, D = 4 * cmath.exp(1j), 10
        gap = D - B
        along = (abs(gap) + (12**2 - 8**2) / abs(gap)) / 2
        C = B + gap / abs(gap) * complex(along, sign * np.sqrt(12**2 - along**2))
        legs = [(C, 0, 8), (4 - 6j, 7, 7), (14 - 5j, 3 + 5j, 9)]
        count += len(scan([Condition("circle", *leg) for leg in legs]))
    assert result.summary["count"] == count > 4
    names = [",".join(label) for label in result.labels]
    assert len(set(names)) == count
    assert {"+,+1", "-,+2"} & set(names)
    for k, name in enumerate(names):
        start = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=[1.0])), mode=name)
        assert start.summary["mode"] == name
        gap = start.bodies["plate"].angle[0] - result.bodies["plate"].angle[k]
        assert abs(np.sin(gap / 2)) < 1e-12


@pytest.mark.parametrize(
    ("name", "label"), [("stephenson-six-bar", "-,-"), ("triad-six-modes", "-2")]
)
def test_labels_on_the_command_line_may_begin_with_minus(name, label, capsys) -> None:
    assert main(["solve", name, "--task", "turn", "--poses", "2", "--mode", label]) == 0
    assert f"mode      {label}\n" in capsys.readouterr().out


def test_whole_turns_that_a_gear_tells_apart() -> None:
    mechanism = md.load("triad-six-modes").mechanism
    geared = replace(
        mechanism,
        bodies={**mechanism.bodies, "wheel": md.Body("wheel", {"B": (0, 0)})},
        joints={
            **mechanism.joints,
            "hub": md.Revolute("hub", "ground.B", "wheel.B"),
            "mesh": md.Gear("mesh", "leg2.B", "wheel.B", ratio="3/2"),
        },
    )
    result = modes(geared, "crank.angle", 0.0)
    assert (result.summary["count"], result.summary["proven"]) == (18, True)
    turns = np.exp(1j * result.bodies["wheel"].angle)
    phi = np.round(result.bodies["platform"].angle, 9)
    assert len({(p, *np.round([t.real, t.imag], 9)) for p, t in zip(phi, turns, strict=True)}) == 18
