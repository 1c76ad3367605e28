"""Assembly modes: counts against brute force, labels, what is said when nothing is proven."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mechdae as md
from tests.shared.mechanisms import four_bar, triad
from tests.shared.strategies import bounded, orders


def counts(mechanism: md.Mechanism, coordinate: str, value: float) -> tuple[int, bool]:
    summary = md.solve(mechanism, md.Modes(md.Driver(coordinate, at=[value]))).summary
    return summary["count"], summary["proven"]


def test_four_bar_has_two_mirrored_modes() -> None:
    mechanism = four_bar(4, 12, 8, 10, crank=1.0, coupler=0.4, rocker=1.0)
    result = md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[1.0])))
    assert result.labels == (("+",), ("-",))
    B = 4 * np.exp(1j)
    C = result.points["coupler.C"].position
    C = C[:, 0] + 1j * C[:, 1]
    assert np.abs(C - B) == pytest.approx([12, 12], rel=1e-14)
    assert np.abs(C - 10) == pytest.approx([8, 8], rel=1e-14)
    turned = np.imag(np.conj(C - B) * (10 - C))
    assert turned[0] > 0 > turned[1]


@pytest.mark.parametrize(("crank", "count"), [(0.2, 2), (1.3, 2), (1.4, 0), (3.0, 0)])
def test_no_mode_beyond_the_limit(crank: float, count: int) -> None:
    mechanism = four_bar(5, 3, 4.5, 7, crank=0.6, coupler=0.9, rocker=1.8)
    assert counts(mechanism, "crank.angle", crank) == (count, True)
    if not count:
        result = md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[crank])))
        e = abs(5 * np.exp(1j * crank) - 7)
        assert "joint C stays open" in result.fault
        assert f"{e - 7.5:.4g}"[:5] in result.fault


def geared_roots(ratio: float, turns: int, lengths: tuple[float, ...], wheel: float) -> int:
    """Return the number of crank angles over `turns` turns that close the loop (dense scan)."""
    l0, l1, l2, l3 = lengths
    a = np.linspace(0, 2 * np.pi * turns, 200_001)
    b = a + (wheel - a) / ratio
    gap = np.abs(l0 + l1 * np.exp(1j * a) - l2 * np.exp(1j * b)) ** 2 - l3**2
    return int(np.sum(gap[:-1] * gap[1:] < 0))


@pytest.mark.parametrize(
    ("ratio", "turns"), [("-1", 1), ("-1/2", 1), ("-2", 2), ("2/3", 2), ("3", 3), ("-3/2", 3)]
)
@pytest.mark.parametrize("wheel", [0.3, 4.0])
def test_geared_five_bar_against_a_scan(ratio: str, turns: int, wheel: float) -> None:
    problem = md.load("geared-five-bar").with_values({"i42": ratio})
    number = float(eval(ratio))
    lengths = (0.1, 0.048, 0.09, 0.08)
    driver = md.Driver("wheel.angle", at=[wheel])
    result = md.solve(problem.mechanism, md.Modes(driver))
    assert result.summary["proven"]
    assert result.summary["count"] == geared_roots(number, turns, lengths, wheel)
    signs = [label[0][0] for label in result.labels]
    ranks = [int(label[0][1:]) for label in result.labels]
    for sign in "+-":
        own = [rank for rank, s in zip(ranks, signs, strict=True) if s == sign]
        assert own == list(range(1, len(own) + 1))


def test_an_irrational_ratio_has_infinitely_many_modes() -> None:
    problem = md.load("geared-five-bar").with_values({"i42": "-sqrt(2)"})
    result = md.solve(problem, "modes")
    assert not result.summary["proven"]
    assert "infinitely many" in result.fault


def test_a_group_whose_outer_pins_meet_is_said_to_be_free() -> None:
    result = md.solve("peaucellier", "modes")
    assert not result.summary["proven"]
    assert result.summary["free"] == ["II.1 RRR(6,7)"]
    assert result.summary["count"] == 4


def test_a_triad_closes_in_all_its_modes() -> None:
    mechanism = triad()
    sketch = {"crank": 0.3, "leg1": 0.6, "leg2": 2.0, "leg3": -1.0, "plate": 0.3}
    sketched = replace(mechanism, sketch=sketch)
    result = md.solve(sketched, md.Modes(md.Driver("crank.angle", at=[0.3])))
    assert result.summary["proven"]
    assert result.summary["count"] == 2
    for k in range(result.summary["count"]):
        for a, b in (("leg1.D", "plate.D"), ("leg2.E", "plate.E"), ("leg3.F", "plate.F")):
            gap = result.points[a].position[k] - result.points[b].position[k]
            assert np.abs(gap).max() < 1e-12


def test_the_sketch_chooses_the_nearest_mode() -> None:
    for degrees in (-20, 0, 20):
        shift = math.radians(degrees)
        upper = four_bar(4, 12, 8, 10, crank=1.0, coupler=0.47 + shift, rocker=1.6 - shift)
        lower = four_bar(4, 12, 8, 10, crank=1.0, coupler=-0.9 + shift, rocker=-1.9 + shift)
        task = md.Sweep(md.Driver("crank.angle", at=[1.0]))
        high = md.solve(upper, task).points["coupler.C"].position[0, 1]
        low = md.solve(lower, task).points["coupler.C"].position[0, 1]
        assert high > 0 > low


def bar_crank(**sketch: float) -> md.Mechanism:
    """Return a slider-crank whose rod is a massless bar, guide at 0.3 rad and offset."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (0.01, 0.02)}),
        bodies=[md.Body("crank", {"O": (0, 0), "A": (0.05, 0)}), md.Body("slider", {"C": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Distance("bar", "crank.A", "slider.C", length=0.15),
            md.Prismatic("guide", "ground.G", "slider.C", axis=0.3),
        ],
        sketch={"crank": 0.9, **sketch},
    )


def test_a_line_and_a_circle_meet_twice() -> None:
    result = md.solve(bar_crank(), md.Modes(md.Driver("crank.angle", at=[0.9])))
    assert (result.summary["count"], result.summary["proven"]) == (2, True)
    A = 0.05 * np.exp(0.9j)
    start = 0.01 + 0.02j - A
    along = np.real(np.exp(-0.3j) * start)
    reach = np.sqrt(0.15**2 - np.imag(np.exp(-0.3j) * start) ** 2)
    slides = sorted(result.joints["guide"].slide)
    assert slides == pytest.approx([-along - reach, -along + reach], rel=1e-13)
    assert {sketch["guide"] for sketch in result.summary["sketches"]} == set(slides)
    far = replace(
        bar_crank(),
        joints={
            **bar_crank().joints,
            "bar": md.Distance("bar", "crank.A", "slider.C", length=0.01),
        },
    )
    assert counts(far, "crank.angle", 0.9) == (0, True)


@pytest.mark.parametrize(
    ("sketch", "high"),
    [({"guide": 0.1}, True), ({"guide": -0.1}, False), ({"slider.C.x": 0.2}, True)],
)
def test_a_slide_in_the_sketch_chooses_the_mode(sketch: dict, high: bool) -> None:
    result = md.solve(bar_crank(**sketch), md.Sweep(md.Driver("crank.angle", at=[0.9])))
    assert (result.joints["guide"].slide[0] > 0) == high
    with pytest.raises(md.MechanismError, match="add guide to"):
        md.solve(bar_crank(), md.Sweep(md.Driver("crank.angle", at=[0.9])))
    with pytest.raises(md.UnknownName, match=r"sketch\.slidr"):
        md.solve(bar_crank(slidr=1.0), md.Sweep(md.Driver("crank.angle", at=[0.9])))


def test_modes_need_one_pose() -> None:
    mechanism = four_bar(4, 12, 8, 10, crank=1.0, coupler=0.4, rocker=1.0)
    with pytest.raises(md.InputError, match="one pose"):
        md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[1.0, 2.0])))


def test_limit_cuts_the_list() -> None:
    result = md.solve("jansen-leg", "modes")
    task = replace(result.definition, limit=3)
    cut = md.solve("jansen-leg", task)
    assert len(cut) == 3
    assert cut.labels == result.labels[:3]
    assert cut.summary["count"] == result.summary["count"] == 8  # of all, not of those listed
    assert cut.summary["notes"] == ["the first 3 of 8 modes are listed"]
    assert "notes" not in result.summary


def test_a_list_of_modes_starts_on_none() -> None:
    task = replace(md.load("slider-crank").tasks["modes"], mode="+")
    with pytest.raises(md.InputError, match="mode: all modes are listed"):
        md.solve("slider-crank", task)


def crane(**sketch: float) -> md.Mechanism:
    """Return an arm lifted by an oscillating cylinder."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (0.8, 0.3)}),
        bodies=[
            md.Body("barrel", {"O": (0, 0)}),
            md.Body("rod", {"C": (0, 0)}),
            md.Body("arm", {"G": (0, 0), "C": (0.5, 0.1)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "barrel.O"),
            md.Prismatic("cylinder", "barrel.O", "rod.C"),
            md.Revolute("C", "rod.C", "arm.C"),
            md.Revolute("G", "ground.G", "arm.G"),
        ],
        sketch=sketch,
    )


def test_a_driving_cylinder_makes_a_triangle_of_two_modes() -> None:
    driver = md.Driver("cylinder.slide", at=[0.9])
    result = md.solve(crane(), md.Modes(driver))
    assert (result.summary["count"], result.summary["proven"]) == (2, True)
    C = result.points["arm.C"].position
    assert np.hypot(*C.T) == pytest.approx([0.9] * 2, rel=1e-13)
    assert np.hypot(*(C - [0.8, 0.3]).T) == pytest.approx([np.hypot(0.5, 0.1)] * 2, rel=1e-13)


def test_printed_labels_lead_back_to_the_same_pose() -> None:
    driver = md.Driver("cylinder.slide", at=[0.9])
    modes = md.solve(crane(), md.Modes(driver))
    labels = [",".join(label) for label in modes.labels]
    assert len(set(labels)) == len(labels) == modes.summary["count"]
    for k, label in enumerate(labels):
        result = md.solve(crane(), md.Sweep(driver), mode=label)
        assert result.summary["mode"] == label
        for body in ("barrel", "arm"):
            gap = result.bodies[body].angle[0] - modes.bodies[body].angle[k]
            assert abs(np.sin(gap / 2)) < 1e-12


def test_far_off_sketches_are_noted() -> None:
    near = four_bar(4, 12, 8, 10, crank=1.0, coupler=0.47, rocker=1.6)
    task = md.Sweep(md.Driver("crank.angle", at=[1.0]))
    assert "notes" not in md.solve(near, task).summary
    far = four_bar(4, 12, 8, 10, crank=1.0, coupler=1.3, rocker=2.4)
    assert "degrees away" in md.solve(far, task).summary["notes"][0]
    slip = four_bar(4, 12, 8, 10, crank=60, coupler=20, rocker=80)
    task = md.Sweep(md.Driver("crank.angle", from_=0, to=360))
    with pytest.raises(md.MechanismError, match="chooses no assembly mode") as caught:
        md.solve(slip, task)
    assert "did you mean crank_deg" in caught.value.hint
    slip = four_bar(4, 12, 8, 10, crank=1.0, coupler=0.47, rocker=1.6)
    notes = md.solve(slip, task).summary["notes"]
    assert any("57.3 turns of crank; did you mean to_deg" in note for note in notes)
    # no whole number of radians: only the poses are few for the turns
    slip = four_bar(4, 12, 8, 10, crank=1.0, coupler=0.47, rocker=1.6)
    odd = md.Sweep(md.Driver("crank.angle", from_=0, to=114.6 * math.pi))
    notes = md.solve(slip, odd).summary["notes"]
    assert any("turns 57.3 times" in note for note in notes)


def planet_on_a_block(order: str, ratio: float, block: float) -> md.Mechanism:
    """A block on the crank's pin slides along an arm, 200 degrees from it, with a planet on it."""
    block_turn, up = math.radians(200), math.radians(90)
    arm = math.atan2(1, -3)
    bodies = {
        "crank": md.Body("crank", points={"O": (0, 0), "A": (1, 0)}),
        "arm": md.Body("arm", points={"Q": (0, 0)}),
        "block": md.Body("block", points={"A": (0, 0)}),
        "wheel": md.Body("wheel", points={"A": (0, 0), "P": (1, 0)}),
    }
    return md.Mechanism(
        ground=md.Ground(points={"O": (0, 0), "Q": (3, 0)}),
        bodies=[bodies[name] for name in order.split()],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("Q", "ground.Q", "arm.Q"),
            md.Revolute("A", "crank.A", "block.A"),
            md.Prismatic("guide", "arm.Q", "block.A", axis=0.0, turn=block_turn),
            md.Revolute("W", "block.A", "wheel.A"),
            md.Gear("mesh", "wheel.A", "ground.O", ratio=ratio, carrier="block"),
        ],
        sketch={"crank": up, "arm": arm, "block": block, "wheel": (1 - ratio) * block},
    )


@bounded
@given(
    orders("crank arm block wheel"),
    st.sampled_from([0.37, 0.5, 0.1 * math.pi]) | st.floats(0.2, 0.9),
    st.integers(-3, 2),
)
def test_the_body_that_gears_hang_on_decides_about_whole_turns(
    order: tuple[str, ...], ratio: float, turns: int
) -> None:
    """Whatever turn its guide is sketched on, and in whatever order bodies are declared."""
    block = math.atan2(1, -3) + math.radians(200) + 2 * math.pi * turns
    mechanism = planet_on_a_block(" ".join(order), ratio, block)
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=[math.pi / 2])))
    notes = result.summary.get("notes", [])
    assert all("did you mean block_deg?" in note for note in notes)  # nothing else is said
    assert result.bodies["block"].angle[0] == pytest.approx(block, abs=1e-14)
    assert result.bodies["wheel"].angle[0] == pytest.approx((1 - ratio) * block, abs=1e-14)


def test_modes_that_differ_by_whole_turns_have_labels_of_their_own() -> None:
    """The turns are counted from the sketch; each label leads to its own mode."""
    driver = md.Driver("crank.angle", at=[math.pi / 2])
    first = math.atan2(1, -3) + math.radians(200)
    for turns in (0, 3):  # of the sketch
        block = first + 2 * math.pi * turns
        mechanism = planet_on_a_block("crank arm block wheel", 0.25, block)
        modes = md.solve(mechanism, md.Modes(driver))
        labels = [",".join(label) for label in modes.labels]
        assert len(set(labels)) == len(labels) == modes.summary["count"] == 8
        own = md.solve(mechanism, md.Sweep(driver)).summary["mode"][0]
        for k, label in enumerate(labels):
            sign, _, number = label.split(",")[0].partition(":")
            # on the other mode the arm points away from the crank: half a turn back
            near = block + 2 * math.pi * int(number or 0) - math.pi * (sign != own)
            assert modes.bodies["block"].angle[k] == pytest.approx(near, abs=1e-12)
            result = md.solve(mechanism, md.Sweep(driver), mode=label)
            assert result.summary["mode"] == label
            for body in ("block", "wheel"):
                gap = result.bodies[body].angle[0] - modes.bodies[body].angle[k]
                assert abs(gap) < 1e-12


def test_a_group_that_moves_by_itself_is_not_said_to_stay_open() -> None:
    """A kite with its crank on the frame: every angle of the rocker closes."""
    kite = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (1, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (1, 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (2, 0)}),
            md.Body("rocker", {"D": (0, 0), "C": (2, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch={"crank": 0.0, "coupler": 0.3, "rocker": 0.3},
    )
    result = md.solve(kite, md.Modes(driver=md.Driver("crank.angle", at=(0.0,))))
    assert result.summary["free"] == ["II.1 RRR(2,3)"]
    assert "II.1 RRR(2,3) moves by itself at this pose: its outer pins coincide" in result.fault
    assert "stays open" not in result.fault
    with pytest.raises(md.AssemblyError, match="moves by itself"):
        md.solve(kite, md.Sweep(md.Driver("crank.angle", from_=0.0, to=6.0)))
