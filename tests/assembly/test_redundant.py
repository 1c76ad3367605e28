"""Redundant mechanisms: more equations than the count allows, and they move all the same."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.coordinates import coordinate
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.values import Table
from mechdae.equations.groups import formula
from mechdae.equations.model import Model
from mechdae.equations.reduction import scene
from mechdae.errors import AssemblyError, MechanismError
from mechdae.kernels.graphs.blocks import left_inverse
from mechdae.results.tables import table
from mechdae.tasks.show import rank_mobility, structure
from tests.shared.mechanisms import doubled, moved

OUT_OF_LINE = [(0.0, 0.0), (2.0, 0.0), (1.0, 0.7)]


def parallelogram(
    pins: list[tuple[float, float]],
    lengths: list[float] | None = None,
    holes: list[tuple[float, float]] | None = None,
    sketch: float = 1.0,
    size: float = 1.0,
) -> Mechanism:
    """Return a beam on cranks with the ground pins `pins`; the first crank is c1.

    `lengths` of the cranks are 1 and the beam's `holes` are those of the ground by default.
    """
    lengths, holes = lengths or [1.0] * len(pins), holes or pins
    bodies, joints = [], []
    for k, length in enumerate(lengths, start=1):
        bodies.append(md.Body(f"c{k}", {"A": (0, 0), "B": (length * size, 0)}))
        joints.append(md.Revolute(f"A{k}", f"ground.A{k}", f"c{k}.A"))
        joints.append(md.Revolute(f"B{k}", f"c{k}.B", f"beam.B{k}"))
    places = {f"B{k}": (x * size, y * size) for k, (x, y) in enumerate(holes, start=1)}
    return md.Mechanism(
        ground=md.Ground({f"A{k}": (x * size, y * size) for k, (x, y) in enumerate(pins, start=1)}),
        bodies=[*bodies, md.Body("beam", places)],
        joints=joints,
        sketch={"beam": 0.0, **{body.name: sketch for body in bodies}},
    )


def turn(mechanism: Mechanism, driver: str = "c1.angle", to: float = 2 * math.pi, **task):
    low = task.pop("low", 0.0)
    sweep = md.Sweep(md.Driver(driver, from_=low, to=to), **{"poses": 37, **task})
    return md.solve(mechanism, sweep)


def ground_with(mechanism: Mechanism, **points) -> md.Ground:
    return md.Ground({**mechanism.ground.points, **points})


# -- cranks that repeat each other -----------------------------------------------------------


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_third_crank_out_of_line_leaves_no_change_point(size: float) -> None:
    result = turn(parallelogram(OUT_OF_LINE, size=size), poses=181)
    assert np.all(result.status == "ok")
    assert result.events == ()
    assert result.summary["formula"] == "I(1) -> II 3 links(2,3,4) [1 redundant]"
    phi = result.drivers["c1.angle"].position
    for body, exact in (("c2", phi), ("c3", phi), ("beam", 0 * phi)):
        gap = np.abs(result.bodies[body].angle - exact)
        assert np.all(gap <= result.bound.angle)
        assert gap.max() < 4e-15
        rate = 0.0 if body == "beam" else 1.0
        assert np.abs(result.bodies[body].angular_velocity - rate).max() < 1e-13
        assert np.abs(result.bodies[body].angular_acceleration).max() < 1e-12
    tip = size * np.stack([1 + np.cos(phi), 0.7 + np.sin(phi)], axis=1)
    gap = np.linalg.norm(result.points["beam.B3"].position - tip, axis=1)
    assert np.all(gap <= result.bound.length)
    assert result.bound.length.max() < 1e-11 * size
    assert result.summary["closure"]["length"] <= 4e-15 * size
    assert result.summary["superfluous"] == [{"joints": ["B1", "A2", "B2", "A3", "B3"], "count": 1}]


def test_a_thousand_turns() -> None:
    mechanism = parallelogram(OUT_OF_LINE)
    result = turn(mechanism, to=2000 * math.pi, poses=2001, derivatives=0)
    assert np.all(result.status == "ok")
    phi = result.drivers["c1.angle"].position
    for body, exact in (("c2", phi), ("c3", phi), ("beam", 0 * phi)):
        gap = np.abs(result.bodies[body].angle - exact)
        assert np.all(gap <= result.bound.angle)
        assert np.all(gap <= 4 * np.spacing(np.maximum(phi, 1.0)))
    assert result.summary["work"]["path_steps"] < 170 * 1000
    arc = md.solve(
        mechanism, md.Sweep(md.Driver("c1.angle", range="assembled"), poses=13, derivatives=0)
    )
    assert arc.summary["limits"] == [None, None]


def test_a_bar_without_a_body_is_a_third_crank_as_well() -> None:
    two = parallelogram(OUT_OF_LINE[:2])
    beam = md.Body("beam", {"B1": (0, 0), "B2": (2, 0), "B3": (1, 0.7)})
    mechanism = replace(
        two,
        ground=ground_with(two, A3=(1, 0.7)),
        bodies={**two.bodies, "beam": beam},
        joints={**two.joints, "bar": md.Distance("bar", "ground.A3", "beam.B3", length=1.0)},
    )
    result = turn(mechanism)
    assert result.summary["formula"] == "I(1) -> II 2 links(2,3) [1 redundant]"
    assert np.all(result.status == "ok")
    gap = np.abs(result.bodies["c2"].angle - result.drivers["c1.angle"].position)
    assert gap.max() < 4e-15
    wrong = mechanism.with_values({"bar.length": 1.001})
    with pytest.raises(AssemblyError, match=r"stays open by 0\.00\d+ m; .* bar 1 is"):
        turn(wrong)


@pytest.mark.parametrize(
    ("changes", "joint", "gap"),
    [
        # the tip of a crank of another length misses its hole by the difference
        ({"lengths": [1, 1, 1.01]}, "B3", 0.01),
        ({"lengths": [1, 1, 0.99]}, "B3", 0.01),
        ({"lengths": [1, 1, 1 + 1e-9]}, "B3", 1e-9),
        # crank 3 reaches its hole but for | A3 + e(phi) + (0, 0.001) - A3 | - 1
        (
            {"holes": [(0, 0), (2, 0), (1, 0.701)]},
            "B3",
            math.hypot(math.cos(1), math.sin(1) + 1e-3) - 1,
        ),
    ],
)
def test_dimensions_that_do_not_close_are_refused(changes, joint, gap) -> None:
    with pytest.raises(AssemblyError) as caught:
        turn(parallelogram(OUT_OF_LINE, **changes))
    text = str(caught.value)
    assert f"joint {joint} stays open by" in text
    assert "1 is redundant" in text
    assert "A2, B2, A3, B3" in text
    size = float(text.split("stays open by ")[1].split(" m")[0])
    assert size == pytest.approx(gap, rel=0.1 if gap < 1e-8 else 2e-3)


def test_dimensions_that_close_at_one_pose_only() -> None:
    """A shorter third crank, its ground pin placed so that it fits at phi = 1."""
    hole = (1.0, 0.7)
    pin = (1 + math.cos(1) - 0.8 * math.cos(0.3), 0.7 + math.sin(1) - 0.8 * math.sin(0.3))
    mechanism = parallelogram([(0, 0), (2, 0), pin], [1, 1, 0.8], [(0, 0), (2, 0), hole])
    result = turn(mechanism, low=0.5, to=1.5, poses=21)
    assert not np.any(result.status == "ok")
    assert {event["kind"] for event in result.events} == {"locked"}
    assert result.events[0]["at"] == pytest.approx(1.0, abs=1e-9)
    # the hole's distance from the crank's circle at the first pose, the less of both modes:
    # the second one has the third corner mirrored in the diagonal from the first tip to A2
    tip, corner = np.exp(0.5j), 2 + np.exp(0.5j)
    mirrored = 2 + (tip - 2) * np.conj((corner - 2) / (tip - 2))
    turned = [(end - tip) / 2 for end in (corner, mirrored)]
    miss = min(abs(abs(tip + one * complex(*hole) - complex(*pin)) - 0.8) for one in turned)
    entry = result.summary["failed"][0]
    assert (entry["joint"], entry["unit"]) == ("B3", "m")
    assert entry["gap"] == pytest.approx(miss, rel=1e-6)
    assert "redundant equations hold there, but no further" in result.fault


def test_data_that_close_to_rounding_are_taken() -> None:
    third = 0.1 + 0.2
    assert third != 0.3
    result = turn(parallelogram(OUT_OF_LINE, [0.3, 0.3, third]))
    assert np.all(result.status == "ok")
    phi = result.drivers["c1.angle"].position
    gaps = [np.abs(result.bodies[body].angle - phi).max() for body in ("c2", "c3")]
    assert max(gaps) <= result.bound.angle.min()
    # an offset far from the origin has coarser data: the same mechanism a kilometre away
    far = [(x + 1234.1, y - 777.7) for x, y in OUT_OF_LINE]
    away = turn(parallelogram(far, holes=OUT_OF_LINE))
    assert np.all(away.status == "ok")
    assert np.abs(away.bodies["c3"].angle - phi).max() <= away.bound.angle.max() < 1e-9


def test_modes_are_those_that_fit_all_cranks() -> None:
    at = md.Driver("c1.angle", at=[1.0])
    found = md.solve(parallelogram(OUT_OF_LINE), md.Modes(at))
    assert (found.summary["count"], found.summary["proven"]) == (1, True)
    assert found.labels == (("+1",),)
    assert found.bodies["beam"].angle[0] == pytest.approx(0, abs=1e-15)
    assert found.summary["superfluous"][0]["count"] == 1
    # without the third crank there are two
    assert md.solve(parallelogram(OUT_OF_LINE[:2]), md.Modes(at)).summary["count"] == 2
    failed = md.solve(parallelogram(OUT_OF_LINE, [1, 1, 1.01]), md.Modes(at))
    assert failed.summary["count"] == 0
    assert "B3 stays open by 0.01 m" in failed.fault


def test_both_modes_of_a_doubled_coupler() -> None:
    problem = doubled(md.load("four-bar-crank-rocker"), "coupler")
    found = md.solve(problem, "modes")
    assert (found.summary["count"], found.summary["proven"]) == (2, True)
    assert found.labels == (("+1",), ("+2",))
    crossed = md.solve(problem, "turn", mode="+1", poses=5)
    open_ = md.solve(problem, "turn", mode="+2", poses=5)
    assert crossed.summary["mode"] == "+1"
    assert np.all(crossed.status == "ok")
    assert crossed.bodies["rocker"].angle[0] != pytest.approx(open_.bodies["rocker"].angle[0])
    # first pose at 0: the open rocker by the law of cosines, the crossed one mirrored
    a, b, c, d = 0.04, 0.12, 0.08, 0.1
    angle = math.pi - math.acos(((d - a) ** 2 + c**2 - b**2) / (2 * (d - a) * c))
    both = sorted(float(r.bodies["rocker"].angle[0]) % (2 * math.pi) for r in (crossed, open_))
    assert both == pytest.approx([angle, 2 * math.pi - angle], rel=1e-14)


# -- the beam on six cranks ------------------------------------------------------------------


def test_rank_of_the_five_loops() -> None:
    """24 equations, 21 coordinates, rank 20; 19 where the cranks lie along the beam."""
    problem = md.load("five-crank-parallelogram")
    count = structure(problem)["mobility"]
    assert (count["W"], count["rank"]["mobility"]) == (-3, 1)
    assert (count["rank"]["equations"], count["rank"]["rank"]) == (24, 20)
    assert len(count["rank"]["superfluous"]) == 12
    whole = scene(Model(problem.mechanism), [coordinate(problem.mechanism, "crank0.angle")])
    assert len(whole.model.q_names) == 21
    assert [(len(b.x), len(b.units)) for b in whole.blocks] == [(6, 10)]

    def pose(phi: float) -> dict[tuple[str, str], float]:
        q = {("beam", "x"): math.cos(phi), ("beam", "y"): math.sin(phi), ("beam", "angle"): 0.0}
        for k in range(6):
            q |= {(f"crank{k}", "x"): float(k), (f"crank{k}", "y"): 0.0}
            q[(f"crank{k}", "angle")] = phi
        return q

    assert rank_mobility(whole, pose(0.0))["rank"] == 19
    assert rank_mobility(whole, pose(1.0))["rank"] == 20
    # the reference has its coordinates at the centres: a crank's origin is R (-1/2, 0) from there
    model, q = whole.model, pose(1.0)
    jacobian = ca.Function("J", [model.q, model.p], [ca.densify(model.phi_q)])
    J = np.array(jacobian(np.array([q[n] for n in model.q_names]), model.p_values))
    place = {name: j for j, name in enumerate(model.q_names)}
    for body, centre in [("beam", 2.5), *((f"crank{k}", 0.5) for k in range(6))]:
        theta = q[(body, "angle")]
        x, y, angle = (place[(body, name)] for name in ("x", "y", "angle"))
        J[:, angle] += centre * (math.sin(theta) * J[:, x] - math.cos(theta) * J[:, y])
    sigma = np.linalg.svd(J)[1]
    assert sigma[19] == pytest.approx(0.5591302668922393, rel=1e-12)
    assert sigma[20] < 1e-15


IN_LINE = [(float(k), 0.0) for k in range(6)]


def test_change_points_where_the_rank_drops() -> None:
    result = turn(parallelogram(IN_LINE), to=4 * math.pi, poses=73)
    assert np.all(result.status == "ok")
    phi = result.drivers["c1.angle"].position
    for k in range(2, 7):
        gap = np.abs(result.bodies[f"c{k}"].angle - phi)
        assert np.all(gap <= result.bound.angle)
        assert gap.max() < 1e-13
    inside = [event for event in result.events if event["in_range"]]
    assert [event["at"] for event in inside] == [pytest.approx(k * math.pi) for k in range(5)]
    for event in inside:
        assert (event["kind"], event["action"], event["exact"]) == (
            "change_point",
            "continue",
            True,
        )
        # the crossed mode of the first two cranks does not fit the third
        assert event["excluded"]
        assert all(other is None for _, other in event["tangents"].values())
    assert result.summary["closure"]["length"] < 1e-13


@pytest.mark.parametrize("action", ["stop", "switch"])
def test_a_path_may_stop_where_the_rank_drops(action: str) -> None:
    result = turn(parallelogram(IN_LINE), low=0.2, to=4.0, on_change_point=action)
    phi = result.drivers["c1.angle"].position
    assert np.array_equal(result.status == "ok", phi < math.pi)
    ends = [event["at"] for event in result.events if event["action"] == "stop"]
    assert ends == pytest.approx([0, math.pi], abs=1e-12)
    assert ("does not meet the redundant equations" in result.fault) == (action == "switch")


def test_both_branches_of_a_doubled_beam() -> None:
    """Two cranks in line with a doubled beam: both branches meet all equations."""
    pins = [(0.0, 0.0), (2.0, 0.0)]
    mechanism = doubled(md.Problem(parallelogram(pins), Table({})), "beam").mechanism
    for action in ("continue", "switch"):
        result = turn(mechanism, low=0.5, to=6.0, on_change_point=action)
        assert np.all(result.status == "ok")
        phi = result.drivers["c1.angle"].position
        exact = phi.copy()
        if action == "switch":  # behind pi: circles of 2 and 1 about crank's tip and (2, 0)
            behind = phi > math.pi
            tip = np.exp(1j * phi[behind])
            corner, chord = 2 + tip, 2 - tip
            mirrored = 2 + chord * np.conj((corner - 2) / chord)
            exact[behind] = np.unwrap(np.angle(mirrored - 2)) % (2 * np.pi)
        gap = np.abs(np.exp(1j * result.bodies["c2"].angle) - np.exp(1j * exact))
        assert np.all(gap <= result.bound.angle + 1e-15)
        crossing = next(e for e in result.events if e["in_range"])
        assert crossing["at"] == pytest.approx(math.pi, abs=1e-12)
        assert "excluded" not in crossing


def test_a_start_where_the_rank_drops() -> None:
    result = turn(parallelogram(IN_LINE[:3], sketch=0.0), to=1.0, poses=5)
    assert "the motion stops at c1.angle = 0 deg" in result.fault
    assert not np.any(result.status == "ok")


def test_near_a_change_point_the_bound_still_holds() -> None:
    result = turn(parallelogram(IN_LINE), low=1e-4, to=0.5, poses=101)
    assert np.all(result.status == "ok")
    phi = result.drivers["c1.angle"].position
    for k in range(2, 7):
        gap = np.abs(result.bodies[f"c{k}"].angle - phi)
        assert np.all(gap <= result.bound.angle)
    assert result.bound.angle[0] < 1e-8


# -- sliders ---------------------------------------------------------------------------------


def wedges(turns: tuple[float, float, float] = (0.0, 0.3, 0.3)) -> Mechanism:
    """Return wedge 1 on the ground, wedge 2 on its slope of 30 degrees and in a vertical guide."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "V": (0.5, 0)}),
        bodies=[md.Body("w1", {"P": (0, 0)}), md.Body("w2", {"Q": (0, 0)})],
        joints=[
            md.Prismatic("p1", "ground.O", "w1.P", axis=0.0, turn=turns[0]),
            md.Prismatic("p12", "w1.P", "w2.Q", axis=math.pi / 6, turn=turns[1]),
            md.Prismatic("p2", "ground.V", "w2.Q", axis=math.pi / 2, turn=turns[2]),
        ],
    )


@pytest.mark.parametrize(
    ("driver", "low", "high"),
    [("p1.slide", 0.05, 0.2), ("p2.slide", 0.1, 0.2), ("p12.slide", 0.3, 0.5)],
)
def test_wedges(driver: str, low: float, high: float) -> None:
    """Three sliding pairs in a loop: W = 0 by the count; x + s cos 30 = 0.5, s sin 30 = y."""
    result = turn(wedges(), driver, low=low, to=high)
    assert np.all(result.status == "ok")
    x, s, y = (result.joints[name].slide for name in ("p1", "p12", "p2"))
    assert np.abs(x + s * math.cos(math.pi / 6) - 0.5).max() < 4e-16
    assert np.abs(y - s * math.sin(math.pi / 6)).max() < 4e-16
    rates = [result.joints[name].slide_velocity for name in ("p1", "p12", "p2")]
    unit = np.array([-math.cos(math.pi / 6), 1.0, math.sin(math.pi / 6)])
    driven = ["p1.slide", "p12.slide", "p2.slide"].index(driver)
    assert np.abs(np.stack(rates) - (unit / unit[driven])[:, None]).max() < 1e-15
    assert result.summary["superfluous"][0]["count"] == 1
    assert result.summary["closure"]["angle"] < 1e-15


def test_angles_of_wedges_must_add_up() -> None:
    with pytest.raises(AssemblyError, match=r"joint p2 stays open by 0\.01 rad"):
        turn(wedges((0.0, 0.3, 0.31)), "p1.slide", low=0.05, to=0.2)
    # rounding and whole turns do not count
    for last in (0.1 + 0.2, 0.1 + 0.2 + 2 * math.pi, 0.3 - 4 * math.pi):
        result = turn(wedges((0.1, 0.2, last)), "p1.slide", low=0.05, to=0.2)
        assert np.all(result.status == "ok")


def guided(axis: float, second: float | None = None, width: float = 0.05) -> Mechanism:
    """Return a slider-crank whose slider runs on two parallel guides."""
    n = (-width * math.sin(axis), width * math.cos(axis))
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (0, 0), "H": n}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (0.05, 0)}),
            md.Body("rod", {"A": (0, 0), "B": (0.2, 0)}),
            md.Body("slider", {"B": (0, 0), "C": n}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "rod.A"),
            md.Revolute("B", "rod.B", "slider.B"),
            md.Prismatic("g", "ground.G", "slider.B", axis=axis),
            md.Prismatic("h", "ground.H", "slider.C", axis=axis if second is None else second),
        ],
        sketch={"crank": 1.0, "rod": axis - 0.2},
    )


@pytest.mark.parametrize("axis", [0.0, 0.3, math.pi / 2])
def test_double_guide(axis: float) -> None:
    result = turn(guided(axis), "crank.angle")
    assert np.all(result.status == "ok")
    phi = result.drivers["crank.angle"].position - axis
    exact = 0.05 * np.cos(phi) + np.sqrt(0.04 - (0.05 * np.sin(phi)) ** 2)
    gap = np.abs(result.joints["g"].slide - exact)
    assert np.all(gap <= result.bound.length + 1e-16)
    assert np.abs(result.joints["h"].slide - exact).max() < 1e-15
    assert result.summary["stroke"]["g"] == pytest.approx(0.1, rel=1e-14)
    assert result.summary["superfluous"] == [{"joints": ["g", "h"], "count": 2}]


def test_guides_that_are_not_parallel_are_refused() -> None:
    with pytest.raises(AssemblyError, match=r"joint h stays open by 0\.001 rad") as caught:
        turn(tilted(0.001), "crank.angle")
    assert "2 are redundant" in str(caught.value)
    with pytest.raises(AssemblyError, match=r"stays open by \S+ m"):
        turn(guided(0.3, second=0.301), "crank.angle")


def test_a_guide_out_of_reach_is_no_matter_of_superfluous_equations() -> None:
    """Both guides on a turning arm, the slider's rod too short: distance of the pivot less rod."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "D": (0.4, 0)}),
        bodies=[
            md.Body("arm", {"O": (0, 0), "G": (0.05, 0), "H": (0.05, 0.03)}),
            md.Body("slider", {"B": (0, 0), "C": (0, 0.03)}),
            md.Body("rod", {"B": (0, 0), "D": (0.3, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "arm.O"),
            md.Prismatic("g", "arm.G", "slider.B", axis=0.0),
            md.Prismatic("h", "arm.H", "slider.C", axis=0.0),
            md.Revolute("B", "slider.B", "rod.B"),
            md.Revolute("D", "ground.D", "rod.D"),
        ],
        sketch={"arm": 1.0, "rod": -0.5},
    )
    with pytest.raises(AssemblyError) as caught:
        turn(mechanism, "arm.angle", low=0.3, to=1.2)
    size = float(str(caught.value).split("stays open by ")[1].split(" m")[0])
    assert size == pytest.approx(0.4 * math.sin(1.0) - 0.3, rel=1e-3)
    assert "redundant and must" not in str(caught.value)


def tilted(angle: float) -> Mechanism:
    mechanism = guided(0.0)
    guide = replace(mechanism.joints["h"], turn=angle)
    return replace(mechanism, joints={**mechanism.joints, "h": guide})


def scott_russell(offset: float = 0.0) -> Mechanism:
    """Return crank OA and rod BAC, OA = AB = AC, both ends of the rod guided."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "V": (offset, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (0.1, 0)}),
            md.Body("rod", {"B": (-0.1, 0), "A": (0, 0), "C": (0.1, 0)}),
            md.Body("s", {"B": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "rod.A"),
            md.Revolute("B", "rod.B", "s.B"),
            md.Prismatic("x", "ground.O", "s.B", axis=0.0),
            md.PinInSlot("y", "ground.V", "rod.C", axis=math.pi / 2),
        ],
        sketch={"crank": 2.0, "rod": math.pi - 2.0},
    )


def test_three_points_of_one_ellipse_link() -> None:
    """The two slides alone stop at their dead points; with the crank the rod turns fully."""
    result = turn(scott_russell(), "crank.angle", to=4 * math.pi, poses=73)
    assert np.all(result.status == "ok")
    phi = result.drivers["crank.angle"].position
    assert np.all(np.abs(result.bodies["rod"].angle - (math.pi - phi)) <= result.bound.angle)
    assert np.abs(result.joints["x"].slide - 0.2 * np.cos(phi)).max() < 1e-15
    assert result.summary["stroke"]["y"] == pytest.approx(0.4, rel=1e-14)
    with pytest.raises(AssemblyError, match=r"stays open by .* 1 is redundant"):
        turn(scott_russell(1e-3), "crank.angle")
    slide = replace(scott_russell(), sketch={"crank": 2.0, "rod": math.pi - 2, "x": -0.08})
    arc = md.solve(slide, md.Sweep(md.Driver("x.slide", range="assembled"), poses=5))
    assert arc.summary["limits"] == pytest.approx([-0.2, 0.2], rel=1e-13)
    assert list(arc.status) == ["limit", "ok", "ok", "ok", "limit"]


def gears(ratio: float) -> Mechanism:
    """Return three wheels on the ground, the third one in mesh with both others."""
    wheels = [md.Body(f"w{k}", {"O": (0, 0)}) for k in (1, 2, 3)]
    return md.Mechanism(
        ground=md.Ground({f"O{k}": (k, 0) for k in (1, 2, 3)}),
        bodies=wheels,
        joints=[
            *[md.Revolute(f"R{k}", f"ground.O{k}", f"w{k}.O") for k in (1, 2, 3)],
            md.Gear("g12", "w1.O", "w2.O", ratio=-0.5),
            md.Gear("g23", "w2.O", "w3.O", ratio=-1.0),
            md.Gear("g13", "w1.O", "w3.O", ratio=ratio),
        ],
        sketch={"w1": 0.0},
    )


def test_a_loop_of_gears() -> None:
    result = turn(gears(0.5), "w1.angle")
    assert np.all(result.status == "ok")
    assert np.abs(result.bodies["w3"].angle - 2 * result.drivers["w1.angle"].position).max() < 4e-15
    wrong = turn(gears(0.501), "w1.angle", poses=5)
    # (1/0.5 - 1/0.501) of the turn is missing at the first pose after the start, times a ratio
    assert list(wrong.status) == ["ok"] + ["unassembled"] * 4
    entry = wrong.summary["failed"][0]
    assert entry["joint"] in ("g13", "g23")
    assert entry["gap"] == pytest.approx(math.pi / 2 * (0.501 / 0.5 - 1), rel=2e-2)
    assert entry["unit"] == "rad"


# -- structure -------------------------------------------------------------------------------


def test_groups_do_not_depend_on_the_order() -> None:
    random = np.random.default_rng(5)
    for name, driver, expected in (
        ("parallelogram-three-cranks", "crank.angle", "I(1) -> II 3 links(2,3,4) [1 redundant]"),
        (
            "five-crank-parallelogram",
            "crank0.angle",
            "I(1) -> V 6 links(2,3,4,5,6,7) [4 redundant]",
        ),
    ):
        problem = md.load(name)
        for _ in range(12):
            other = moved(problem, random).mechanism
            whole = scene(Model(other), [coordinate(other, driver)])
            assert formula(whole.groups) == expected


def test_moved_frames_close_to_rounding() -> None:
    """Frames turned and shifted by rounded numbers: the data are consistent to rounding only."""
    random = np.random.default_rng(11)
    problem = md.load("parallelogram-three-cranks")
    for _ in range(3):
        result = md.solve(moved(problem, random), "turn", poses=13)
        assert np.all(result.status == "ok")
        radius = np.linalg.norm(result.points["rod.Q"].position - [1.5, 0.12], axis=1)
        assert np.all(np.abs(radius - 0.3) <= result.bound.length)


def locomotive() -> Mechanism:
    """Return three coupled cranks, a rod from the first one's pin to a piston."""
    base = parallelogram(OUT_OF_LINE)
    return replace(
        base,
        ground=ground_with(base, S=(-5, 0)),
        bodies={
            **base.bodies,
            "rod": md.Body("rod", {"B": (0, 0), "C": (3, 0)}),
            "piston": md.Body("piston", {"C": (0, 0)}),
        },
        joints={
            **base.joints,
            "R": md.Revolute("R", "c1.B", "rod.B"),
            "C": md.Revolute("C", "rod.C", "piston.C"),
            "guide": md.Prismatic("guide", "ground.S", "piston.C", axis=0.0),
        },
        sketch={**base.sketch, "rod": math.pi, "guide": 2.5},
    )


@pytest.mark.parametrize(
    ("driver", "expected"),
    [
        ("c1.angle", "I(1) -> {II 3 links(2,3,4) [1 redundant]; II.2 RRP(5,6)}"),
        ("c3.angle", "I(3) -> II 3 links(1,2,4) [1 redundant] -> II.2 RRP(5,6)"),
        ("guide.slide", "I(6) -> II.1 RRR(1,5) -> II 3 links(2,3,4) [1 redundant]"),
    ],
)
def test_only_the_links_that_share_equations_are_redundant(driver: str, expected: str) -> None:
    mechanism = locomotive()
    whole = scene(Model(mechanism), [coordinate(mechanism, driver)])
    assert formula(whole.groups) == expected
    if driver == "guide.slide":
        task = md.Sweep(md.Driver(driver, range="assembled"), poses=5)
        result = md.solve(mechanism, task)
        assert result.summary["limits"] == pytest.approx([1.0, 3.0], rel=1e-13)
        assert list(result.status) == ["limit", "ok", "ok", "ok", "limit"]
        x = result.drivers[driver].position - 5  # cosine rule in the triangle crank, rod, line
        exact = np.pi - np.arccos((1 + x**2 - 9) / (-2 * x))
        assert np.abs(np.cos(result.bodies["c3"].angle) - np.cos(exact)).max() < 1e-14


def test_a_parallelogram_nobody_drives_has_a_freedom_of_its_own() -> None:
    base = parallelogram(OUT_OF_LINE)
    mechanism = replace(
        base,
        ground=ground_with(base, Z=(9, 9)),
        bodies={**base.bodies, "other": md.Body("other", {"Z": (0, 0)})},
        joints={**base.joints, "Z": md.Revolute("Z", "ground.Z", "other.Z")},
        sketch={**base.sketch, "other": 0.0},
    )
    with pytest.raises(MechanismError, match=r"c1, c2, c3 can still move.*A3, B3 depend"):
        turn(mechanism, "other.angle")
    modes = md.solve(mechanism, md.Modes(md.Driver("other.angle", at=[0.3])))
    assert modes.summary["free"] == ["III 4 links(1,2,3,4)"]
    assert not modes.summary["proven"]


@pytest.mark.parametrize("extra", [(), ("third",)])
def test_parallel_guides_leave_a_slider_free(extra: tuple[str, ...]) -> None:
    far = (2 * math.cos(0.3), 2 * math.sin(0.3))
    joints = [
        md.Revolute("O", "ground.O", "k.O"),
        md.Prismatic("p", "ground.G", "s.P", axis=0.3),
        md.PinInSlot("q", "ground.H", "s.Q", axis=0.3),
        *[md.Prismatic(name, "ground.H", "s.Q", axis=0.3) for name in extra],
    ]
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (1, 0), "H": (1 + far[0], far[1])}),
        bodies=[md.Body("k", {"O": (0, 0)}), md.Body("s", {"P": (0, 0), "Q": far})],
        joints=joints,
        sketch={"k": 0.0},
    )
    with pytest.raises(MechanismError, match="freedom of its own: s can still move"):
        turn(mechanism, "k.angle")


def test_a_superfluous_driver() -> None:
    """Driven twice: refused where the values disagree, taken where they agree."""
    mechanism = parallelogram(OUT_OF_LINE)

    def drive(second: float):
        at = {"c1.angle": 1.2, "c2.angle": second}
        drivers = tuple(md.Driver(name, at=[value]) for name, value in at.items())
        return md.solve(replace(mechanism, sketch={**mechanism.sketch}), md.Sweep(drivers=drivers))

    with pytest.raises(AssemblyError, match="or a driver"):
        md.solve(
            replace(mechanism, sketch={"beam": 0.0, "c3": 1.0}),
            md.Sweep(drivers=(md.Driver("c1.angle", at=[1.2]), md.Driver("c2.angle", at=[1.3]))),
        )
    assert list(drive(1.2).status) == ["ok"]


def test_laws_of_time_and_jerk() -> None:
    """Six cranks in line swing through their change points and back."""
    times = tuple(np.linspace(0.0, 6.0, 25))
    driver = md.Driver("c1.angle", law="1 + 3*sin(t)", times=times)
    result = md.solve(parallelogram(IN_LINE), md.Sweep(driver, derivatives=3))
    assert np.all(result.status == "ok")
    t = np.array(times)
    exact = (1 + 3 * np.sin(t), 3 * np.cos(t), -3 * np.sin(t), -3 * np.cos(t))
    for order, theirs in enumerate(exact):  # digits go with the condition's 1st, 3rd, 5th power
        gap = np.abs(list(result.bodies["c4"].values())[order] - theirs)
        assert np.all(gap <= 1e-14 * result.condition ** max(2 * order - 1, 0))
        assert gap.max() < (1e-14, 1e-13, 1e-11, 1e-8)[order]
    assert sum(event["in_range"] for event in result.events) == 4


def test_a_study_keeps_dimensions_that_depend_on_each_other() -> None:
    problem = md.load("parallelogram-three-cranks")
    outputs = ("points/rod.Q/position", "summary/closure/length")
    study = md.Study(of="turn", vary={"h": (0.1, 0.3, 3)}, outputs=outputs)
    result = md.solve(replace(problem, tasks=Table({**problem.tasks, "heights": study})), "heights")
    assert list(result.status) == ["ok"] * 3
    places = result.table["points/rod.Q/position"]
    assert places.shape == (3, 361, 2)
    assert np.abs(places[:, 0, 1] - [0.1, 0.2, 0.3]).max() < 1e-15
    # one dimension alone does not close
    wrong = replace(study, vary={"rod.Q.y": (0.11, 0.13, 3)}, outputs=outputs[:1])
    tasks = Table({**problem.tasks, "heights": wrong})
    failed = md.solve(replace(problem, tasks=tasks), "heights")
    assert list(failed.status) == ["unassembled", "ok", "unassembled"]


# -- kernels and outputs -----------------------------------------------------------------------


@pytest.mark.parametrize(("m", "n"), [(2, 1), (3, 2), (4, 3), (10, 6)])
def test_left_inverse_loses_no_digits(m: int, n: int) -> None:
    random = np.random.default_rng(1)
    J = ca.SX.sym("J", m, n)
    function = ca.Function("A", [J], [left_inverse(J)], {"cse": True})
    for power in (0, 4, 7):
        u, _, v = np.linalg.svd(random.normal(size=(m, n)), full_matrices=False)
        matrix = u @ np.diag(np.logspace(0, -power if n > 1 else 0, n)) @ v
        A = np.array(function(matrix))
        size = 10.0**power
        assert np.abs(A @ matrix - np.eye(n)).max() < 4e-15 * size
        assert np.abs(A - np.linalg.pinv(matrix)).max() < 1e-14 * size**2


def test_json_text_and_show_name_what_is_superfluous(capsys) -> None:
    mechanism = parallelogram(OUT_OF_LINE)
    result = turn(mechanism, poses=5)
    data = json.loads(json.dumps(result.to_dict()))
    assert data["summary"]["superfluous"][0]["count"] == 1
    assert 0 <= data["summary"]["closure"]["length"] < 1e-14
    text = table(result)
    assert "1 equation(s) among B1, A2, B2, A3, B3" in text
    assert "closes to" in text
    task = md.Sweep(md.Driver("c1.angle", from_=0.0, to=1.0))
    shown = structure(md.Problem(mechanism, Table({"turn": task})))
    assert [group["superfluous"] for group in shown["groups"]] == [0, 1]
    assert shown["mobility"]["W"] == 0
    assert shown["mobility"]["rank"]["mobility"] == 1
