"""Reactions with friction against published reference values and against free bodies.

The tables hold the values of the reference sets S1 (slider-crank) and Q1 (quick-return), computed
elsewhere with energy balances closed to 1e-21; `force_truth` reproduces them here and gives
the poses between.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest

import mechdae as md
from tests.reference.force_truth import circle, panels
from tests.reference.force_truth import quick_return as free_quick_return
from tests.reference.force_truth import slider_crank as free_slider_crank
from tests.shared.force_cases import INERTIA, S1, quick_return, reactions, slider_crank

JOINTS = ("O", "B", "C", "slide")
ROD = {name: INERTIA[name] for name in ("m_rod", "I_rod", "c_rod", "m_slider")}
SPEED = {"S1a": 10.0, "S1b": 40.0}


def free_bodies(case: str, theta, article: bool = False, work: float = 1000, back: float = 200):
    """Return the scene of a case by free bodies."""
    radii = (S1["r_O"], S1["r_B"], S1["r_C"])
    rho = tuple(np.longdouble(r) * np.longdouble(0.1) if article else circle(r, 0.1) for r in radii)
    return free_slider_crank(
        theta,
        SPEED[case],
        S1["r"],
        S1["l"],
        lambda v: np.where(v < 0, work, -back),
        rho,
        S1["f_slide"],
        **(ROD if case == "S1b" else {}),
    )


@functools.cache
def solved(case: str, radius: str = "exact", at: tuple[float, ...] = (60.0,)) -> md.Result:
    task = reactions(
        at=np.radians(at), speed=SPEED[case], friction="coupled", friction_radius=radius
    )
    return md.solve(slider_crank(inertia=case == "S1b"), task)


def without(result: md.Result) -> np.ndarray:
    """Return the crank's torque without friction."""
    return np.array(result.value("efforts_uncoupled/crank.angle"))


# -- S1 at 60 degrees ------------------------------------------------------------------------------

# case, coupled: (F01, F23, N, M_g, friction torques O B C, slide force, losses, sum, M1)
AT_60 = {
    ("S1a", False): (
        (1044.46593573419, 1044.46593573419, -301.511344577764, 0.0),
        (2.07856489992599, 1.55892367494449, 1.03928244996299),
        36.1813613493316,
        (20.7856489992599, 18.3029745409267, 1.80915852765453, 36.7885235265711),
        77.6863055944121,
        101.678107607332,
    ),
    ("S1a", True): (
        (1087.65640016506, 1087.65640016506, -322.603427496216, 1.08225856833416),
        (2.16451713666831, 1.62338785250123, 1.08225856833416),
        38.7124112995459,
        (21.6451713666831, 19.059834045716, 1.88397034713579, 39.3620472185453),
        81.9510229780802,
        109.87320990514,
    ),
    ("S1b", False): (
        (1218.5582526251, 1164.82164372732, -362.964235141611, 0.0),
        (2.42502155959854, 1.81876616969891, 1.15904085547021),
        43.5557082169933,
        (97.0008623839417, 85.4149088500647, 8.07052461108564, 177.14647948004),
        367.632775325132,
        115.852559245742,
    ),
    ("S1b", True): (
        (1269.31283455158, 1216.81663423726, -387.806875855629, 1.21077780473222),
        (2.52602695277935, 1.89452021458452, 1.21077780473222),
        46.5368251026755,
        (101.041078111174, 88.972554108003, 8.43077448523882, 189.271052419737),
        387.715459124153,
        125.545445723846,
    ),
}
VELOCITIES = {
    "S1a": (-1.74077655955698, -1.01678107607332),
    "S1b": (-6.96310623822791, -4.06712430429328),
}
REL = 1e-11


@pytest.mark.parametrize("key", AT_60, ids=str)
def test_free_bodies_reproduce_the_table_at_60_degrees(key) -> None:
    case, coupled = key
    forces, torques, slide, losses, total, effort = AT_60[key]
    scene, motion = free_bodies(case, np.pi / 3)
    found = scene.solve(friction=coupled)
    ours = [abs(found["O"][0]), abs(found["C"][0]), *found["slide"][:, 0]]
    assert [float(x) for x in ours] == pytest.approx(forces, rel=2e-14, abs=1e-12)
    lost = [float(found.loss(name)[0]) for name in JOINTS]
    assert lost == pytest.approx(losses, rel=2e-14)
    assert sum(lost) == pytest.approx(total, rel=2e-14)
    spins = [abs(float(scene.joints[name].spin[0])) for name in "OBC"]
    assert [p / w for p, w in zip(lost, spins, strict=False)] == pytest.approx(torques, rel=2e-14)
    speeds = (float(motion["rod"].c[1][0]), float(motion["slide"].c[1][0]))
    assert speeds == pytest.approx(VELOCITIES[case], rel=2e-14)
    assert lost[3] / abs(speeds[1]) == pytest.approx(slide, rel=2e-14)
    assert float(found["T"][0]) == pytest.approx(effort, rel=2e-14)


@pytest.mark.parametrize("case", ["S1a", "S1b"])
def test_coupled_reactions_at_60_degrees(case: str) -> None:
    forces, torques, slide, losses, total, effort = AT_60[case, True]
    result = solved(case)
    assert list(result.status) == ["ok"]
    assert result.fault is None
    joints = result.joints
    size = [np.hypot(*joints[name].reaction[0, :2]) for name in ("O", "C")]
    assert size == pytest.approx(forces[:2], rel=REL)
    assert joints["slide"].normal[0] == pytest.approx(forces[2], rel=REL)
    assert joints["slide"].reaction[0, 2] == pytest.approx(forces[3], rel=REL)
    # the slider moves towards O: friction on it points along +x
    assert joints["slide"].reaction[0] == pytest.approx([slide, forces[2], forces[3]], rel=REL)
    assert [abs(joints[name].reaction[0, 2]) for name in "OBC"] == pytest.approx(torques, rel=REL)
    assert [joints[name].loss[0] for name in JOINTS] == pytest.approx(losses, rel=REL)
    assert sum(joints[name].loss[0] for name in JOINTS) == pytest.approx(total, rel=REL)
    assert result.efforts["crank.angle"][0] == pytest.approx(effort, rel=REL)
    assert result.bodies["rod"].angular_velocity[0] == pytest.approx(VELOCITIES[case][0], rel=REL)
    assert joints["slide"].slide_velocity[0] == pytest.approx(VELOCITIES[case][1], rel=REL)


@pytest.mark.parametrize("case", ["S1a", "S1b"])
def test_reactions_without_friction_stand_beside(case: str) -> None:
    forces, _, _, losses, total, effort = AT_60[case, False]
    result = solved(case)
    joints = result.joints
    size = [np.hypot(*joints[name].reaction_uncoupled[0, :2]) for name in ("O", "C")]
    assert size == pytest.approx(forces[:2], rel=REL)
    assert joints["slide"].reaction_uncoupled[0] == pytest.approx(
        [0, forces[2], 0], rel=REL, abs=REL * abs(forces[2])
    )
    assert [joints[name].loss_uncoupled[0] for name in JOINTS] == pytest.approx(losses, rel=REL)
    assert sum(joints[name].loss_uncoupled[0] for name in JOINTS) == pytest.approx(total, rel=REL)
    assert without(result)[0] == pytest.approx(effort, rel=REL)
    # the same as the task without friction
    plain = md.solve(
        slider_crank(inertia=case == "S1b"),
        reactions(at=[np.pi / 3], speed=SPEED[case], friction="none"),
    )
    assert plain.efforts["crank.angle"][0] == pytest.approx(effort, rel=REL)
    for name in JOINTS:
        assert plain.joints[name].reaction == pytest.approx(
            joints[name].reaction_uncoupled, rel=1e-13, abs=1e-11
        )


def test_the_approximate_friction_circle() -> None:
    joints = solved("S1a", "article").joints
    assert sum(joints[n].loss_uncoupled[0] for n in JOINTS) == pytest.approx(
        77.8902858227222, rel=REL
    )
    assert sum(joints[n].loss[0] for n in JOINTS) == pytest.approx(82.1701997301639, rel=REL)
    assert solved("S1a", "article").efforts["crank.angle"][0] == pytest.approx(
        109.895127580348, rel=REL
    )
    scene, _ = free_bodies("S1a", np.pi / 3, article=True)
    found = scene.solve()
    assert float(found["T"][0]) == pytest.approx(109.895127580348, rel=2e-14)


# -- S1 all round ----------------------------------------------------------------------------------

# no pose on a change of a direction of sliding
AROUND = tuple(float(x) for x in np.arange(0.5, 360, 1.0))


@pytest.mark.parametrize("case", ["S1a", "S1b"])
def test_every_component_all_round(case: str) -> None:
    result = solved(case, at=AROUND)
    assert set(result.status) == {"ok"}
    scene, _ = free_bodies(case, np.radians(AROUND))
    for found, suffix in ((scene.solve(), ""), (scene.solve(friction=False), "_uncoupled")):
        effort = found["T"]
        ours = np.array(result.value(f"efforts{suffix}/crank.angle"))
        # relative to what the forces at this pose could do at the crank
        biggest = max_force(found)
        assert np.all(np.abs(ours - effort) <= REL * np.maximum(np.abs(effort), biggest * 0.01))
        for name in JOINTS:
            joint = result.joints[name]
            gap = np.abs(getattr(joint, f"reaction{suffix}") - found.reaction(name))
            assert np.all(gap[:, :2] <= REL * biggest[:, None]), (name, suffix)
            assert np.all(gap[:, 2] <= REL * biggest * 0.02), (name, suffix)
            lost = np.abs(getattr(joint, f"loss{suffix}") - found.loss(name))
            assert np.all(lost <= REL * biggest * 4), (name, suffix)
    normal = scene.solve()["slide"][0]
    assert np.all(np.abs(result.joints["slide"].normal - normal) <= REL * max_force(scene.solve()))


def max_force(found) -> np.ndarray:
    return np.max([np.abs(found[name]) for name in "OBC"], axis=0)


@pytest.mark.parametrize("case", ["S1a", "S1b"])
def test_checks_are_small(case: str) -> None:
    checks = solved(case, at=AROUND).checks
    for name in ("virtual_power", "energy", "balance"):
        assert 0 <= checks[name] < 1e-12, name


# -- S1 over a cycle -------------------------------------------------------------------------------

CYCLE = {
    "S1a": {
        "useful": 381.971863420549,
        "loss": 36.7969095080391,
        "input": 418.768772928588,
        "efficiency": 0.912130722520912,
        "efficiency_formula_10": 0.907399965025289,
        "efficiency_uncoupled": 0.915248002919152,
        "loss_uncoupled": 35.3706079120983,
        "ratio": 1.04032448634995,
        "by_joint": (12.6573419747, 9.49508260569, 1.34777865653, 13.2967062711),
        "by_joint_uncoupled": (12.2946044025, 9.22095330185, 1.31724376582, 12.537806442),
    },
    "S1b": {
        "useful": 1527.8874536822,
        "loss": 166.007826784596,
        "input": 1693.89528046679,
        "efficiency": 0.901996405150353,
        "efficiency_formula_10": 0.895091068244518,
        "efficiency_uncoupled": 0.905051965152637,
        "loss_uncoupled": 160.289040608403,
        "ratio": 1.03567796122858,
        "by_joint": (58.3874871631, 45.4937116364, 5.9088076601, 56.217820325),
        "by_joint_uncoupled": (56.9331806633, 44.392759775, 5.78466950073, 53.1784306694),
    },
}
KINKS = {
    "S1a": [0.0, 90.0, 180.0, 270.0, 360.0],
    "S1b": [0, 90, 180, 270, 299.611050533, 299.916228259, 358.663956298, 360],
}
MEAN = 1e-9


@functools.cache
def cycle(case: str, radius: str = "exact") -> md.Result:
    task = reactions(
        from_=0,
        to=2 * np.pi,
        speed=SPEED[case],
        poses=13,
        friction="coupled",
        friction_radius=radius,
        cycle=True,
    )
    return md.solve(slider_crank(inertia=case == "S1b"), task)


@pytest.mark.parametrize("case", ["S1a", "S1b"])
def test_free_bodies_reproduce_the_mean_values(case: str) -> None:
    expected = CYCLE[case]
    at, weights = panels([float(x) for x in np.radians(KINKS[case])], 6, 40)
    scene, _ = free_bodies(case, at)
    coupled, plain = scene.solve(), scene.solve(friction=False)
    omega = SPEED[case]
    assert float((plain["T"] * omega) @ weights) == pytest.approx(expected["useful"], rel=MEAN)
    assert float((coupled["T"] * omega) @ weights) == pytest.approx(expected["input"], rel=MEAN)
    for found, key in ((coupled, "by_joint"), (plain, "by_joint_uncoupled")):
        means = [float(found.loss(name) @ weights) for name in JOINTS]
        assert means == pytest.approx(expected[key], rel=MEAN)


@pytest.mark.parametrize("case", ["S1a", "S1b"])
def test_mean_values_of_a_cycle(case: str) -> None:
    expected = CYCLE[case]
    summary = cycle(case).summary
    for name in (
        "useful",
        "loss",
        "input",
        "efficiency",
        "efficiency_formula_10",
        "efficiency_uncoupled",
    ):
        assert summary[name] == pytest.approx(expected[name], rel=MEAN), name
    by_joint = [summary["loss_by_joint"][name] for name in JOINTS]
    assert by_joint == pytest.approx(expected["by_joint"], rel=MEAN)
    beside = [summary["loss_by_joint_uncoupled"][name] for name in JOINTS]
    assert beside == pytest.approx(expected["by_joint_uncoupled"], rel=MEAN)
    assert sum(beside) == pytest.approx(expected["loss_uncoupled"], rel=MEAN)
    assert summary["loss"] / sum(beside) == pytest.approx(expected["ratio"], rel=MEAN)
    assert summary["jammed_arcs"] == []
    assert summary["self_locking_arcs"] == []


def test_mean_values_with_the_approximate_friction_circle() -> None:
    summary = cycle("S1a", "article").summary
    assert summary["efficiency_formula_10"] == pytest.approx(0.907101827841818, rel=MEAN)
    assert summary["efficiency_uncoupled"] == pytest.approx(0.914998327817922, rel=MEAN)
    assert summary["efficiency"] == pytest.approx(0.91187181209931, rel=MEAN)


@pytest.mark.parametrize(
    ("case", "expected"),
    [
        ("S1a", [90.0, 180.0, 270.0]),
        ("S1b", [90.0, 180.0, 270.0, 299.916228259, 358.663956298]),
    ],
)
def test_kinks_of_a_cycle(case: str, expected: list[float]) -> None:
    # the speed of the rod or of the slider changes sign, or the normal force of the guide
    kinks = np.degrees(
        [k["at"] if isinstance(k, dict) else k for k in cycle(case).summary["kinks"]]
    )
    for kink in expected:
        assert np.abs(kinks - kink).min() < 1e-8, (kink, kinks)


def test_mean_values_do_not_depend_on_the_grid() -> None:
    fine = reactions(from_=0, to=2 * np.pi, speed=40, poses=100, friction="coupled", cycle=True)
    summary = md.solve(slider_crank(inertia=True), fine).summary
    for name in ("useful", "loss", "input", "efficiency"):
        assert summary[name] == pytest.approx(CYCLE["S1b"][name], rel=MEAN), name


@pytest.mark.parametrize(
    ("low", "high", "speed"),
    [
        (0, 2 * np.pi, -40),  # the mirror image
        (2 * np.pi, 0, -40),
        (0.3, 0.3 + 2 * np.pi, 40),
        (0, 4 * np.pi, 40),
    ],
)
def test_mean_values_do_not_depend_on_where_and_how_the_turn_is_made(low, high, speed) -> None:
    task = reactions(from_=low, to=high, speed=speed, poses=9, friction="coupled", cycle=True)
    summary = md.solve(slider_crank(inertia=True), task).summary
    for name in ("useful", "loss", "input", "efficiency"):
        assert summary[name] == pytest.approx(CYCLE["S1b"][name], rel=MEAN), name


@pytest.mark.parametrize("s", [1e-6, 1e3])
def test_friction_at_other_scales(s: float) -> None:
    lengths = {name: S1[name] * s for name in ("r", "l", "r_O", "r_B", "r_C")}
    task = reactions(from_=0, to=2 * np.pi, speed=10, poses=9, friction="coupled", cycle=True)
    result = md.solve(slider_crank(**lengths), task)
    assert result.summary["efficiency"] == pytest.approx(CYCLE["S1a"]["efficiency"], rel=MEAN)
    assert result.summary["loss"] == pytest.approx(CYCLE["S1a"]["loss"] * s, rel=MEAN)
    driven = md.solve(slider_crank(Q_work=-1000, Q_return=-1000, **lengths), task)
    arcs = np.degrees(driven.summary["self_locking_arcs"])
    assert arcs[0] == pytest.approx([0, BEFORE_TDC], abs=1e-9)
    assert arcs[1] == pytest.approx([AFTER_BDC, 360 - AFTER_BDC], abs=1e-9)


# lambda, f: largest ratio of losses, efficiency by formula (10), eta* uncoupled, eta coupled
GUIDE_ONLY = [
    (1 / 3, 0.05, 1.01799579322, 0.98632337478812, 0.98650790116718, 0.98630688417877),
    (1 / 3, 0.1, 1.036651153, 0.97264674957624, 0.97337502907351, 0.97258015427395),
    (1 / 3, 0.2, 1.07609113379, 0.94529349915247, 0.94813106698066, 0.94502187353813),
    (1 / 3, 0.4, 1.16471566963, 0.89058699830495, 0.9013775739712, 0.88945534970675),
    (0.9, 0.05, 1.11512193242, 0.93839710635327, 0.94197181072565, 0.93750415699252),
    (0.9, 0.1, 1.26019840842, 0.87679421270654, 0.89030880299295, 0.87298061988572),
    (0.9, 0.2, 1.70342754431, 0.75358842541308, 0.80230320416546, 0.73580600843911),
    (0.9, 0.4, 5.74371460211, 0.50717685082615, 0.66987171290411, 0.38935309866868),
]


@pytest.mark.parametrize(("share", "f", "ratio", "ten", "star", "coupled"), GUIDE_ONLY)
def test_friction_in_the_guide_alone(share, f, ratio, ten, star, coupled) -> None:
    mechanism = slider_crank(joints="s", l=0.1 / share, f_slide=f, Q_return=1000)
    task = reactions(from_=0, to=2 * np.pi, speed=1, poses=9, friction="coupled", cycle=True)
    result = md.solve(mechanism, task)
    assert result.summary["efficiency_formula_10"] == pytest.approx(ten, rel=MEAN)
    assert result.summary["efficiency_uncoupled"] == pytest.approx(star, rel=MEAN)
    assert result.summary["efficiency"] == pytest.approx(coupled, rel=MEAN)
    # exact at every pose: losses in the ratio 1/(1 - f tan beta), largest at 90 degrees
    at = np.array([0.4, 1.0, np.pi / 2, 2.6, 4.0])
    posed = md.solve(mechanism, reactions(at=at, speed=1, friction="coupled"))
    guide = posed.joints["slide"]
    tangent = np.abs(np.tan(np.arcsin(share * np.sin(at))))
    assert guide.loss / guide.loss_uncoupled == pytest.approx(1 / (1 - f * tangent), rel=REL)
    assert guide.loss[2] / guide.loss_uncoupled[2] == pytest.approx(ratio, rel=2e-11)


# -- S1 driven from the slider ---------------------------------------------------------------------

BEFORE_TDC = 1.85325010277072
AFTER_BDC = 177.149345823584
OUTPUT = {  # free of friction, coupled, uncoupled (M - P/omega)
    20: (44.9854493815398, 40.1815943920971, 40.0710353369872),
    60: (101.678107607332, 94.2889836443041, 93.9094770478908),
    90: (100.0, 92.4957634864912, 92.0634722030467),
    120: (71.5269731495557, 65.6216683506235, 65.3919992393199),
}


def test_dead_zones_by_free_bodies() -> None:
    for end in (BEFORE_TDC, AFTER_BDC):
        scene, _ = free_bodies("S1a", np.radians([end - 1e-9, end + 1e-9]), work=-1000, back=-1000)
        torque = scene.solve()["T"]
        assert torque[0] * torque[1] < 0, end


def test_dead_zones_of_a_driven_crank() -> None:
    task = reactions(from_=0, to=2 * np.pi, speed=10, poses=25, friction="coupled", cycle=True)
    mechanism = slider_crank(Q_work=-1000, Q_return=-1000)
    arcs = md.solve(mechanism, task).summary["self_locking_arcs"]
    ends = sorted(float(end) for arc in np.degrees(arcs) for end in arc)
    expected = [BEFORE_TDC, AFTER_BDC, 360 - AFTER_BDC, 360 - BEFORE_TDC]
    inner = [end for end in ends if 1e-6 < end < 360 - 1e-6]
    assert inner == pytest.approx(expected, abs=1e-9)
    # a full turn is covered from its beginning to its end
    assert [ends[0], ends[-1]] == pytest.approx([0, 360], abs=1e-9) or len(ends) == 4


def test_output_torque_of_a_driven_crank() -> None:
    at = list(OUTPUT)
    task = reactions(at=np.radians(at), speed=10, friction="coupled")
    result = md.solve(slider_crank(Q_work=-1000, Q_return=-1000), task)
    free, coupled, uncoupled = np.array([OUTPUT[k] for k in at]).T
    assert -result.efforts["crank.angle"] == pytest.approx(coupled, rel=REL)
    assert -without(result) == pytest.approx(free, rel=REL)
    lost = sum(result.joints[name].loss_uncoupled for name in JOINTS)
    assert -without(result) - lost / 10 == pytest.approx(uncoupled, rel=REL)


def test_the_direction_load_turns_the_resistances_round() -> None:
    at = np.radians(list(OUTPUT))
    negative = md.solve(
        slider_crank(Q_work=-1000, Q_return=-1000), reactions(at=at, speed=10, friction="coupled")
    )
    turned = md.solve(
        slider_crank(Q_work=1000, Q_return=1000),
        reactions(at=at, speed=10, friction="coupled", direction="load"),
    )
    assert turned.efforts["crank.angle"] == pytest.approx(negative.efforts["crank.angle"], rel=REL)
    for name in JOINTS:
        assert turned.joints[name].loss == pytest.approx(negative.joints[name].loss, rel=REL)


# -- Q1 --------------------------------------------------------------------------------------------

# block?, pose: P friction-free, P coupled, F coupled, M1 free, M1 coupled, losses free, coupled
Q1 = {
    (True, 30): (
        (120.096115353815, 120.387059573992, 121.733880269264),
        (6.92307692307692, 8.32914477867312),
        (1.91200161882872, 0.882462285613257, 7.9940806503179, 0.397108028525965),
        (1.9380758108238, 0.894496528072523, 8.01344706824059, 0.402523437632635),
        (11.1856525832858, 11.2485428447695),
    ),
    (False, 30): (
        (120.096115353815, 121.857688498384, 123.220961738285),
        (6.92307692307692, 8.06441710264567),
        (1.91200161882872, 6.6637852187064, 0.397108028525965),
        (1.96175103268858, 6.76152980476452, 0.407440599096859),
        (8.97289486606109, 9.13072143654996),
    ),
    (True, 250): (
        (-234.76337336136, -240.442915126261, None),
        (15.863751224323, 18.5661869859567),
        None,
        None,
        (21.0087403854617, 21.6194860930691),
    ),
    (False, 250): (
        (-234.76337336136, -234.783775269035, None),
        (15.863751224323, 17.4231179779079),
        None,
        None,
        (12.4121364916712, 12.474934028679),
    ),
}
Q1_EFFICIENCY = {
    True: (0.798036828357339, 0.831187007434851),
    False: (0.837989398251675, 0.858472079873658),
}
Q1_KINEMATICS = {
    30: (0.249799919935936, 0.443760156980183, 1.84615384615385),
    250: (0.127788247248528, -0.342586891113258, -4.23033365981948),
}
Q1_CYCLE = {
    True: {
        "useful": 62.8751426085382,
        "input": 77.6002538387506,
        "loss": 14.7251112302124,
        "loss_uncoupled": 14.4895274554106,
        "efficiency": 0.810244032695944,
        "efficiency_formula_10": 0.769550781846769,
        "efficiency_uncoupled": 0.812711313272148,
        "by_joint": (2.55239870382, 1.67891767555, 9.8240484286, 0.669746422241),
        "by_joint_uncoupled": (2.49329973182, 1.6353502288, 9.70931827813, 0.651559216658),
    },
    False: {
        "useful": 62.8751426085382,
        "input": 76.0893153058165,
        "loss": 13.2141726972783,
        "loss_uncoupled": 13.0229911646211,
        "efficiency": 0.826333399845062,
        "efficiency_formula_10": 0.792875361799137,
        "efficiency_uncoupled": 0.828414869810322,
    },
}
PINS = {True: ("O", "A", "slot", "G"), False: ("O", "slot", "G")}


def normal(found, block: bool) -> float:
    """Return the normal force on the rod, along its left normal."""
    return -float(found["slot"][0][0] if block else found["slot"][0])


@pytest.mark.parametrize("key", Q1, ids=str)
def test_free_bodies_reproduce_the_quick_return(key) -> None:
    block, phi = key
    force, effort, free, coupled, total = Q1[key]
    scene, motion = free_quick_return(np.radians(phi), block)
    kinematics = [float(motion[k][0]) for k in ("slide", "slide_speed", "w3")]
    assert kinematics == pytest.approx(Q1_KINEMATICS[phi], rel=5e-15)
    for friction, k, losses in ((False, 0, free), (True, 1, coupled)):
        found = scene.solve(friction=friction)
        assert normal(found, block) == pytest.approx(force[k], rel=1e-14)
        assert float(found["T"][0]) == pytest.approx(effort[k], rel=1e-14)
        lost = [float(found.loss(name)[0]) for name in PINS[block]]
        assert sum(lost) == pytest.approx(total[k], rel=1e-14)
        if losses is not None:
            assert lost == pytest.approx(losses, rel=1e-14)


@pytest.mark.parametrize("key", Q1, ids=str)
def test_quick_return_at_a_pose(key) -> None:
    block, phi = key
    force, effort, free, coupled, total = Q1[key]
    task = reactions(at=[np.radians(phi)], speed=8, friction="coupled")
    result = md.solve(quick_return(block), task)
    joints = result.joints
    assert list(result.status) == ["ok"]
    # the reference gives the force on the rod; ours is the one on the block, or on the pin
    assert -joints["slot"].normal[0] == pytest.approx(force[1], rel=REL)
    if force[2] is not None:
        assert np.hypot(*joints["slot"].reaction[0, :2]) == pytest.approx(force[2], rel=REL)
    assert np.hypot(*joints["slot"].reaction_uncoupled[0, :2]) == pytest.approx(
        abs(force[0]), rel=REL
    )
    assert without(result)[0] == pytest.approx(effort[0], rel=REL)
    assert result.efforts["crank.angle"][0] == pytest.approx(effort[1], rel=REL)
    for losses, total_loss, key_ in (
        (free, total[0], "loss_uncoupled"),
        (coupled, total[1], "loss"),
    ):
        lost = [getattr(joints[name], key_)[0] for name in PINS[block]]
        assert sum(lost) == pytest.approx(total_loss, rel=REL)
        if losses is not None:
            assert lost == pytest.approx(losses, rel=REL)
    assert joints["slot"].slide[0] == pytest.approx(Q1_KINEMATICS[phi][0], rel=REL)
    assert joints["slot"].slide_velocity[0] == pytest.approx(Q1_KINEMATICS[phi][1], rel=REL)
    if phi == 30:
        lost, beside = (
            sum(getattr(joints[name], k)[0] for name in PINS[block])
            for k in ("loss", "loss_uncoupled")
        )
        ten = 1 - beside / (without(result)[0] * 8)
        eta = 1 - lost / (result.efforts["crank.angle"][0] * 8)
        assert (ten, eta) == pytest.approx(Q1_EFFICIENCY[block], rel=REL)


@pytest.mark.parametrize("block", [True, False], ids=["block", "pin"])
def test_quick_return_all_round(block: bool) -> None:
    at = np.radians(np.arange(0.5, 360, 2.0))
    result = md.solve(quick_return(block), reactions(at=at, speed=8, friction="coupled"))
    assert set(result.status) == {"ok"}
    found = free_quick_return(at, block)[0].solve()
    size = np.max([np.abs(found["O"]), np.abs(found["G"])], axis=0)
    for name in PINS[block]:
        gap = np.abs(result.joints[name].reaction - found.reaction(name))
        assert np.all(gap <= REL * size[:, None] * [1, 1, 0.02]), name
        gap = np.abs(result.joints[name].loss - found.loss(name))
        assert np.all(gap <= REL * size), name
    gap = np.abs(result.efforts["crank.angle"] - found["T"])
    assert np.all(gap <= REL * size * 0.1)


@pytest.mark.parametrize("block", [True, False], ids=["block", "pin"])
def test_quick_return_over_a_cycle(block: bool) -> None:
    expected = Q1_CYCLE[block]
    task = reactions(from_=0, to=2 * np.pi, speed=8, poses=13, friction="coupled", cycle=True)
    summary = md.solve(quick_return(block), task).summary
    for name in (
        "useful",
        "input",
        "loss",
        "efficiency",
        "efficiency_formula_10",
        "efficiency_uncoupled",
    ):
        assert summary[name] == pytest.approx(expected[name], rel=MEAN), name
    beside = summary["loss_by_joint_uncoupled"]
    assert sum(beside[name] for name in PINS[block]) == pytest.approx(
        expected["loss_uncoupled"], rel=MEAN
    )
    if block:
        for key in ("by_joint", "by_joint_uncoupled"):
            mean = [summary[f"loss_{key}"][name] for name in PINS[block]]
            assert mean == pytest.approx(expected[key], rel=MEAN)


def test_free_bodies_reproduce_the_cycle_of_the_quick_return() -> None:
    # w3 = 0 where the rod touches the crank's circle; for the pin also the contact's speed = 0
    turn = float(np.degrees(np.arccos(0.08 / 0.2)))
    dead = [turn - 90, 270 - turn]
    for block in (True, False):
        kinks = sorted([-90.0, 90.0, 270.0, *dead])
        if not block:
            kinks = sorted([*kinks, *rubbing_stops()])
        edges = [np.radians(k) for k in kinks]
        at, weights = panels(edges, 8, 40)
        scene, _ = free_quick_return(at, block)
        expected = Q1_CYCLE[block]
        assert float(scene.solve()["T"] @ weights) * 8 == pytest.approx(expected["input"], rel=MEAN)
        plain = scene.solve(friction=False)
        assert float(plain["T"] @ weights) * 8 == pytest.approx(expected["useful"], rel=MEAN)
        lost = sum(float(plain.loss(name) @ weights) for name in PINS[block])
        assert lost == pytest.approx(expected["loss_uncoupled"], rel=MEAN)


def rubbing_stops() -> list[float]:
    """Return the crank angles in degrees at which the pin rolls in the slot, by bisection."""

    def speed(phi):
        motion = free_quick_return(phi, False)[1]
        return motion["slide_speed"] - np.sign(motion["w3"]) * 0.012 * (motion["w1"] - motion["w3"])

    grid = np.radians(np.linspace(-90, 270, 3601) + 0.013)
    values = speed(grid)
    found = []
    for k in np.flatnonzero(values[:-1] * values[1:] < 0):
        low, high = grid[k], grid[k + 1]
        for _ in range(60):
            middle = (low + high) / 2
            if speed(middle)[0] * values[k] > 0:
                low = middle
            else:
                high = middle
        found.append(float(np.degrees(low)))
    return found
