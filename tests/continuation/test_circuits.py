"""What the driver can reach from the sketch: all groups side by side on one way of it.

A dyad of two links of length b between the crank's pin and a ground pivot at distance d in the
direction g closes where the pin is at most 2 b away: for |crank - g| up to a half width that is
known in closed form. Of several such dyads the mechanism has the intersection of the intervals.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main

TURN = 2 * math.pi


def length_for(half, d=2.0, r=1.0):
    """Return the links' length with which a dyad closes up to `half` on both sides."""
    return math.sqrt(r * r + d * d - 2 * r * d * math.cos(half)) / 2


def beside(dyads, sketch, sign=1, d=2.0):
    """Return a crank with dyads side by side: (direction of the pivot, half width) each."""
    pin = complex(math.cos(sketch), math.sin(sketch))
    ground, bodies = {"O": (0.0, 0.0)}, [md.Body("crank", points={"O": (0, 0), "A": (1, 0)})]
    joints = [md.Revolute("O", "ground.O", "crank.O")]
    drawn = {"crank": sketch}
    for k, (direction, half) in enumerate(dyads):
        b = length_for(half, d)
        pivot = d * complex(math.cos(direction), math.sin(direction))
        ground[f"G{k}"] = (pivot.real, pivot.imag)
        away = pivot - pin
        height = math.sqrt(b * b - abs(away) ** 2 / 4)
        knee = (pin + pivot) / 2 + 1j * sign * height * away / abs(away)
        for name, start in ((f"rod{k}", pin), (f"rocker{k}", pivot)):
            bodies.append(md.Body(name, points={"P": (0, 0), "C": (b, 0)}))
            drawn[name] = math.atan2((knee - start).imag, (knee - start).real)
        joints += [
            md.Revolute(f"A{k}", "crank.A", f"rod{k}.P"),
            md.Revolute(f"C{k}", f"rod{k}.C", f"rocker{k}.C"),
            md.Revolute(f"R{k}", f"ground.G{k}", f"rocker{k}.P"),
        ]
    return md.Mechanism(ground=md.Ground(points=ground), bodies=bodies, joints=joints, sketch=drawn)


TWO = [(0.0, math.radians(120)), (math.pi, math.radians(120))]
"""One closes for -120 ... 120 degrees, the other for 60 ... 300 degrees."""
ALMOST = 1e-12


def arc(dyads, sketch):
    """Return the interval around the sketch in which all dyads close, in closed form."""
    turned = [math.remainder(sketch - direction, TURN) for direction, _ in dyads]
    up = min(half - t for (_, half), t in zip(dyads, turned, strict=True))
    down = min(half + t for (_, half), t in zip(dyads, turned, strict=True))
    return sketch - down, sketch + up


def test_another_circuit_is_not_reached_either_way_round():
    """At 270 degrees each dyad for itself could be reached, one up and one down."""
    mechanism = beside(TWO, math.pi / 2)
    driver = md.Driver("crank.angle", at=[math.pi / 2, 1.5 * math.pi])
    for task in (md.Sweep(driver), md.Reactions(driver)):
        result = md.solve(mechanism, task)
        assert [str(word) for word in result.status] == ["ok", "unassembled"]
        assert result.summary["limits"] == pytest.approx([math.pi / 3, 2 * math.pi / 3], abs=ALMOST)
        assert "1 of 2 poses are not reached" in result.fault
        assert "-120 deg" not in result.fault
        assert "60 deg, 120 deg" in result.fault
        (entry,) = result.summary["failed"]
        assert entry["assembles"] is True


def test_swing_limits_and_measures_are_those_of_the_assembled_arc():
    mechanism = beside(TWO, math.pi / 2)
    whole = md.Driver("crank.angle", range="assembled")
    wide = md.Driver("crank.angle", from_=math.radians(50), to=math.radians(310))
    measures = ["extremes", "envelope", "transmission"]
    one = md.solve(mechanism, md.Sweep(whole, poses=31, measures=measures))
    other = md.solve(mechanism, md.Sweep(wide, poses=27, measures=measures))
    assert one.summary["limits"] == pytest.approx(other.summary["limits"], abs=ALMOST)
    assert one.summary["swing"]["crank"] == pytest.approx(math.pi / 3, abs=ALMOST)
    for body, swing in one.summary["swing"].items():
        assert other.summary["swing"][body] == pytest.approx(swing, rel=1e-12), body
    for key, entry in one.summary["extremes"].items():
        for word in ("min", "max"):
            assert other.summary["extremes"][key][word] == pytest.approx(entry[word], abs=1e-12)
    reached = [event["at"] for event in other.events if event.get("reached", True)]
    behind = [event["at"] for event in other.events if not event.get("reached", True)]
    assert reached == pytest.approx([math.pi / 3, 2 * math.pi / 3], abs=ALMOST)
    assert behind == pytest.approx([5 * math.pi / 3], abs=ALMOST)  # of one dyad alone


def test_the_other_way_round_with_all_groups():
    """Both dyads close for less than 120 degrees about zero: 250 degrees are -110 degrees."""
    dyads = [(0.0, math.radians(120)), (0.1, math.radians(115))]
    mechanism = beside(dyads, 0.0)
    at = np.radians([0, 100, 120, 200, 251, 260, 359, 360 + 250, -115, -470])
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=at.tolist())))
    low, high = arc(dyads, 0.0)
    turned = (at - low) % TURN
    inside = turned < high - low
    assert [str(word) == "ok" for word in result.status] == inside.tolist()
    straight = md.solve(
        mechanism, md.Sweep(md.Driver("crank.angle", at=(low + turned[inside]).tolist()))
    )
    for body in ("rod0", "rocker1"):
        ours, theirs = (r.bodies[body] for r in (result, straight))
        assert ours.angle[inside] == pytest.approx(theirs.angle, abs=1e-13)
        assert ours.angular_velocity[inside] == pytest.approx(theirs.angular_velocity, abs=1e-12)


def test_a_limit_position_reached_the_other_way_round():
    """The last bits of a turn do not make another status of a limit."""
    dyads = [(0.0, math.radians(120)), (0.1, math.radians(115))]
    low, high = arc(dyads, 0.0)
    at = [low, low + TURN, high, high - TURN, high + 1e-9, low + TURN - 1e-9]
    result = md.solve(beside(dyads, 0.0), md.Sweep(md.Driver("crank.angle", at=at)))
    words = [str(word) for word in result.status]
    assert words == ["limit"] * 4 + ["unassembled"] * 2
    for body in ("rod0", "rocker1"):
        angle = result.bodies[body].angle
        assert angle[1] == pytest.approx(angle[0], abs=1e-6)  # a root of the last bit
        assert angle[3] == pytest.approx(angle[2], abs=1e-6)


def test_random_dyads_side_by_side_against_their_intervals():
    rng = np.random.default_rng(7)
    judged = turned = behind = 0
    while judged < 25:
        count = int(rng.integers(2, 4))
        dyads = [(float(rng.uniform(-3, 3)), float(rng.uniform(1.6, 2.9))) for _ in range(count)]
        sketch = float(rng.uniform(-3, 3))
        low, high = arc(dyads, sketch)
        if min(sketch - low, high - sketch) < 0.2:
            continue
        judged += 1
        at = sketch + rng.uniform(-7, 7, 40)
        mechanism = beside(dyads, sketch, sign=int(rng.choice([-1, 1])))
        result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=at.tolist())))
        inside = (at - low) % TURN < high - low
        assert [str(word) == "ok" for word in result.status] == inside.tolist()
        alone = [np.abs(np.remainder(at - g + math.pi, TURN) - math.pi) < half for g, half in dyads]
        turned += int((inside & ((at < low) | (at > high))).sum())
        behind += int((np.all(alone, axis=0) & ~inside).sum())
    assert turned > 20  # poses a whole turn away
    assert behind > 20  # each dyad closes, on another circuit


def test_a_start_behind_a_limit_is_a_fault_with_the_limit_named(tmp_path, capsys):
    mechanism = beside(TWO, math.pi / 2)
    tasks = {
        "t": md.Sweep(md.Driver("crank.angle", from_=1.5 * math.pi, to=1.6 * math.pi), poses=5)
    }
    md.dump(md.Problem(mechanism=mechanism, tasks=tasks), tmp_path / "two.toml")
    assert main(["solve", str(tmp_path / "two.toml")]) == 1
    err = capsys.readouterr().err
    assert "5 of 5 poses are not reached" in err
    assert "limit positions at crank.angle = 60 deg, 120 deg" in err
    assert "no motion from the sketch leads to it" in err


def test_studies_tell_sets_that_are_on_another_circuit():
    mechanism = beside(TWO, math.pi / 2)
    names = {f"{body}.C.x": [length_for(math.radians(120)), 2.0] for body in ("rod0", "rocker0")}
    driver = md.Driver("crank.angle", at=[math.pi / 2, 1.5 * math.pi])
    outputs = ["bodies/rocker1/angle"]
    tasks = {"t": md.Sweep(driver), "s": md.Study(samples=names, of="t", outputs=outputs)}
    result = md.solve(md.Problem(mechanism=mechanism, tasks=tasks), task="s")
    # with links of 2 the first dyad closes all around, and the other one up to 300 degrees
    assert [str(word) for word in result.status] == ["unassembled", "ok"]


def test_of_several_drivers_one_moves_and_the_other_is_held():
    base = beside(TWO, math.pi / 2)
    idle = md.Body("idle", points={"P": (0, 0)})
    mechanism = md.Mechanism(
        ground=base.ground,
        bodies=[*base.bodies.values(), idle],
        joints=[*base.joints.values(), md.Revolute("I", "ground.G0", "idle.P")],
        sketch={**base.sketch, "idle": 0.3},
    )
    drivers = [
        md.Driver("crank.angle", at=[math.pi / 2, 1.5 * math.pi, 1.6]),
        md.Driver("idle.angle", at=[0.5]),
    ]
    result = md.solve(mechanism, md.Sweep(drivers=drivers))
    assert [str(word) for word in result.status] == ["ok", "unassembled", "ok"]
    moving = [
        md.Driver("crank.angle", at=[math.pi / 2, 1.5 * math.pi, 1.6]),
        md.Driver("idle.angle", at=[0.5, 0.6, 0.7]),
    ]
    words = [str(word) for word in md.solve(mechanism, md.Sweep(drivers=moving)).status]
    assert words == ["ok", "unassembled", "unassembled"]  # on the way there the dyads open
