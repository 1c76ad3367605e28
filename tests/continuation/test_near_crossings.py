"""Branches that nearly meet: the numbers given decide where the motion goes, down to 1e-12 rad.

The closed form of a four-bar is evaluated in 60 digits for the float64 numbers given.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

import mechdae as md
from tests.attack import near_crossings
from tests.shared.mechanisms import four_bar

HALF = np.pi
BESIDE = np.array([1e-3, 3e-5, 3e-6, 1e-6, 1e-7, 1e-8, 1e-9])
AT = np.concatenate(
    [
        np.linspace(0.3, 3.1, 6),
        np.pi - BESIDE,
        [np.pi],
        np.pi + BESIDE[::-1],
        np.linspace(3.2, 6, 6),
    ]
)


def detuned(excess: float = 0.0, aside: float = 0.0, size: float = 1.0, **sketch: float) -> tuple:
    """Return a four-bar and its lengths in mpmath: crank and ground against bar and rocker.

    The rocker is longer by `excess` than where the branches cross; pins beside the bar (`aside`
    above 0) or beside the ground (below 0) make these longer by their square.
    """
    a, b, c, d = (size * own for own in (1.0, 2.5, 1.75 + excess, 3.25))
    beside = size * abs(aside)
    mechanism = four_bar(a, b, c, d, **(sketch or {"crank": 0.5, "coupler": 0.3, "rocker": 1.0}))
    a, b, c, d = (mp.mpf(float(own)) for own in (a, b, c, d))
    turned = mp.mpf(0)
    if aside > 0:
        bodies = {
            **mechanism.bodies,
            "coupler": md.Body("coupler", {"B": (0, 0), "C": (float(b), beside)}),
        }
        mechanism = replace(mechanism, bodies=bodies)
        b = mp.sqrt(b * b + mp.mpf(beside) ** 2)
    if aside < 0:
        ground = md.Ground({"A": (0, 0), "D": (float(d), beside)})
        mechanism = replace(mechanism, ground=ground)
        turned = mp.atan2(mp.mpf(beside), d)
        d = mp.sqrt(d * d + mp.mpf(beside) ** 2)
    return mechanism, (a, b, c, d, turned)


def pin(lengths: tuple, angle: float) -> tuple:
    """Return bar's end C, above the diagonal, at a crank angle from the x axis."""
    a, b, c, d, turned = lengths
    angle = mp.mpf(angle)
    D = d * mp.expj(turned)
    B = a * mp.expj(angle)
    along = D - B
    L = abs(along)
    k = (b * b + L * L - c * c) / (2 * L)
    C = B + (k + 1j * mp.sqrt(b * b - k * k)) * along / L
    return C.real, C.imag


def swept(mechanism: md.Mechanism, at: np.ndarray = AT) -> md.Result:
    driver = md.Driver("crank.angle", at=at.tolist(), speed=1.0)
    return md.solve(mechanism, md.Sweep(driver, derivatives=1))


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(60):
        yield


PASSED = [
    *({"excess": 10.0**-k} for k in (9, 11, 13, 14, 15)), {"excess": 1e-14, "size": 1e-3},
    *({"aside": 10.0**-k} for k in (5, 6, 7, 8, 9, 10, 11)), {"aside": 1e-9, "size": 1e4},
]  # fmt: skip


@pytest.mark.parametrize("keys", PASSED, ids=str)
def test_branches_that_pass_each_other(keys: dict) -> None:
    mechanism, lengths = detuned(**keys)
    result = swept(mechanism)
    assert set(result.status) == {"ok"}
    assert result.summary["bound"] == "proved"
    assert not result.events
    assert result.fault is None
    size = keys.get("size", 1.0)
    place, rate = (getattr(result.points["rocker.C"], word) for word in ("position", "velocity"))
    for k, angle in enumerate(AT.tolist()):
        true = pin(lengths, angle)
        missed = max(abs(float(t - mp.mpf(float(p)))) for t, p in zip(true, place[k], strict=True))
        assert missed <= result.bound.length[k]
        true = [float(mp.diff(lambda u, i=i: pin(lengths, u)[i], angle)) for i in range(2)]
        assert np.abs(rate[k] - true).max() < 1e-4 * size


TURNED = [
    *({"excess": -(10.0**-k)} for k in (9, 11, 12, 13, 14)), {"excess": -1e-15},
    {"excess": -1e-14, "size": 1e-3},
    *({"aside": -(10.0**-k)} for k in (5, 6, 7, 8, 9, 10, 11)), {"aside": -1e-9, "size": 1e4},
]  # fmt: skip


@pytest.mark.parametrize("keys", TURNED, ids=str)
def test_branches_that_turn_back(keys: dict) -> None:
    mechanism, lengths = detuned(**keys)
    a, b, c, d, turned = lengths
    limit = mp.acos((a * a + d * d - (b + c) ** 2) / (2 * a * d)) + turned
    result = swept(mechanism)
    (event,) = (event for event in result.events if event["in_range"])
    assert event["kind"] == "limit"
    gap = abs(keys.get("excess", 0)) ** 0.5 + abs(keys.get("aside", 0))
    assert abs(mp.mpf(event["at"]) - limit) < (2e-15 if gap < 2e-6 else 1e-13)
    u, words = result.drivers["crank.angle"].position, result.status
    off = np.abs(u - np.pi - float(turned)) - float(mp.pi + turned - limit)
    assert set(words[off > 3e-6]) == {"ok"}  # beyond are poses that the crank reaches backwards
    assert set(words[off < -1e-15]) == {"unassembled"}
    assert set(words) <= {"ok", "singular", "limit", "unassembled"}
    place = result.points["rocker.C"].position
    for k in np.flatnonzero(words == "ok"):
        true = pin(lengths, float(u[k]))
        missed = max(abs(float(t - mp.mpf(float(p)))) for t, p in zip(true, place[k], strict=True))
        assert missed <= result.bound.length[k]


def test_four_bars_drawn_at_random() -> None:
    """Folded or stretched near 0 or pi, detuned by 1e-15.5 to 1e-11.5: no pose is ok and wrong."""
    rows = [near_crossings.looked_at(*own) for own in map(near_crossings.drawn, range(48)) if own]
    words = {word for row in rows for word in (*row["words"], *row["kinds"])}
    assert len(rows) > 20
    assert not any(row["wrong"] for row in rows)
    assert words == {"ok", "limit", "unassembled", "singular", "ambiguous", "change_point"}
    left = [row["missed_in_places"] for row in rows if row["open"]]
    assert max(left) < 1.25  # units in the last place of each length
    assert not any(row["estimated"] for row in rows if not row["open"])


def test_the_page_has_the_figures() -> None:
    root = Path(__file__).parents[2] / "docs"
    found = json.loads((root / "data" / "near-crossings.json").read_text(encoding="utf-8"))
    page = (root / "theory/evidence/assembly-modes.md").read_text(encoding="utf-8")
    assert near_crossings.sentence(found) in page
    assert found["ok_and_wrong"] == 0


# -- behind other loops, before other loops --------------------------------------------------------

FIRST = (1.0, 2.5, 2.0, 2.75)


def behind(excess: float) -> tuple:
    """Return a near crossing whose crank is the rocker of a first four-bar, at its crank angle 1.

    A dyad hangs on its rocker.
    """
    lengths = (*map(mp.mpf, FIRST), mp.mpf(0))
    C = mp.mpc(*pin(lengths, 1.0))
    turned = float(mp.arg(C - lengths[3])) + np.pi
    first = four_bar(*FIRST)
    F = (FIRST[3] + 3.25 * np.cos(turned), 3.25 * np.sin(turned))
    ground = md.Ground({"A": (0, 0), "D": (FIRST[3], 0), "F": F, "K": (F[0] + 2.0, F[1])})
    bodies = {
        **first.bodies,
        "rocker": md.Body("rocker", {"D": (0, 0), "C": (FIRST[2], 0), "E": (1, 0)}),
        "bar": md.Body("bar", {"E": (0, 0), "G": (2.5, 0)}),
        "second": md.Body("second", {"F": (0, 0), "G": (1.75 + excess, 0), "H": (0.5, 0)}),
        "rod": md.Body("rod", {"H": (0, 0), "J": (2, 0)}),
        "last": md.Body("last", {"K": (0, 0), "J": (1.5, 0)}),
    }
    joints = [
        *first.joints.values(),
        *(md.Revolute(name, one, two) for name, one, two in (
            ("E", "rocker.E", "bar.E"), ("G", "bar.G", "second.G"), ("F", "ground.F", "second.F"),
            ("H", "second.H", "rod.H"), ("J", "rod.J", "last.J"), ("K", "ground.K", "last.K"),
        )),
    ]  # fmt: skip
    sketch = {
        "crank": 0.6,
        "coupler": 0.5,
        "rocker": 1.5,
        "bar.G.x": 3.0,
        "bar.G.y": 1.0,
        "rod": 0.5,
        "last": 1.5,
    }
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=sketch), (
        lengths,
        F,
        excess,
    )


@pytest.mark.parametrize("excess", [1e-12, 1e-13, -1e-12, -1e-13])
def test_behind_another_loop_and_before_another(excess: float) -> None:
    mechanism, (lengths, F, _) = behind(excess)
    at = np.concatenate(
        [[0.6, 0.8, 0.95], 1 + np.array([-1e-3, -1e-5, 1e-5, 1e-3]), [1.05, 1.2, 1.4]]
    )
    result = swept(mechanism, at)
    events = [event for event in result.events if event["in_range"]]
    assert {event["kind"] for event in events} == ({"limit"} if excess < 0 else set())
    words, u = result.status, result.drivers["crank.angle"].position
    assert set(words[u < 1]) == {"ok"}
    assert set(words[u > 1]) == ({"ok"} if excess > 0 else {"unassembled"})
    d = mp.mpc(*map(mp.mpf, F)) - lengths[3]
    second = (mp.mpf(1), mp.mpf("2.5"), mp.mpf(1.75 + excess), abs(d), mp.arg(d))
    for k in np.flatnonzero(words == "ok"):
        C = mp.mpc(*pin(lengths, float(u[k])))
        angle = mp.arg(C - lengths[3])
        options = [mp.mpc(*pin(second, angle)) + lengths[3]]
        mirrored = options[0] - lengths[3] - mp.expj(angle)
        axis = mp.expj(mp.arg(d - mp.expj(angle)))
        options.append(lengths[3] + mp.expj(angle) + axis**2 * mp.conj(mirrored))
        G = result.points["second.G"].position[k]
        missed = min(abs(complex(own - mp.mpc(*map(mp.mpf, G.tolist())))) for own in options)
        assert missed <= 1.5 * result.bound.length[k]


# -- along laws and lines --------------------------------------------------------------------------

LAWS = [
    ("0.5 + t", np.pi - 0.5, lambda t: mp.mpf("0.5") + t),
    ("2 + 2*sin(t)", float(np.arcsin((np.pi - 2) / 2)), lambda t: 2 + 2 * mp.sin(t)),
]


@pytest.mark.parametrize("excess", [1e-9, 1e-12, 1e-14, -1e-12, -1e-14])
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law[0])
def test_along_a_law(law: tuple, excess: float) -> None:
    """The crank's angle follows a law of time through the place where the branches come near."""
    text, place, exact = law
    times = place + np.concatenate([[-0.6, -0.2], -BESIDE, [0.0], BESIDE[::-1], [0.2, 0.6]])
    mechanism, lengths = detuned(excess)
    driver = md.Driver("crank.angle", law=text, times=times.tolist())
    result = md.solve(mechanism, md.Sweep(driver, derivatives=1))
    assert result.summary["bound"] == "proved"
    if excess > 0:
        assert set(result.status) == {"ok"}
        assert not result.events
    else:
        (event,) = result.events
        a, b, c, d, _ = lengths
        limit = mp.acos((a * a + d * d - (b + c) ** 2) / (2 * a * d))
        assert event["kind"] == "limit"
        assert abs(event["at"] - float(limit)) < 4e-15
        assert set(result.status) <= {"ok", "singular", "unassembled"}
        assert set(result.status[:2]) == {"ok"}
        assert set(result.status[-9:]) == {"unassembled"}
    C = result.points["rocker.C"].position
    for k in np.flatnonzero(result.status == "ok"):
        true = pin(lengths, exact(mp.mpf(float(times[k]))))
        missed = max(abs(float(t - mp.mpf(float(p)))) for t, p in zip(true, C[k], strict=True))
        assert missed <= result.bound.length[k]


def on_a_plate(excess: float) -> tuple:
    """Return the four-bar on a plate that turns too, both turns driven, and its lengths."""
    mechanism, lengths = detuned(excess)
    plate = md.Body("plate", {"O": (0, 0), "A": (0.5, 0), "D": (3.75, 0)})
    joints = [md.Revolute("O", "ground.O", "plate.O")]
    for joint in mechanism.joints.values():
        first, second = (end.replace("ground", "plate") for end in (joint.first, joint.second))
        joints.append(replace(joint, first=first, second=second))
    bodies = {**mechanism.bodies, "plate": plate}
    ground, sketch = md.Ground({"O": (0, 0)}), {**mechanism.sketch, "plate": 0.0}
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=sketch), lengths


@pytest.mark.parametrize("beside", [0.0, 1e-8, -1e-6])
@pytest.mark.parametrize("excess", [1e-9, 1e-13, -1e-13])
def test_two_drivers_along_a_line(excess: float, beside: float) -> None:
    """The middle one of nine poses is next to where the branches come near."""
    mechanism, lengths = on_a_plate(excess)
    middle = np.pi + beside + 0.1
    drivers = [
        md.Driver("plate.angle", from_=0.0, to=0.2),
        md.Driver("crank.angle", from_=0.5, to=2 * middle - 0.5),
    ]
    result = md.solve(mechanism, md.Sweep(drivers=drivers, poses=9, derivatives=1))
    words = result.status
    assert set(words[:4]) == {"ok"}
    assert set(words[5:]) == ({"ok"} if excess > 0 else {"unassembled"})
    assert [event["kind"] for event in result.events] == ([] if excess > 0 else ["limit"])
    angles = [result.drivers[f"{name}.angle"].position for name in ("plate", "crank")]
    C = result.points["rocker.C"].position
    for k in np.flatnonzero(words == "ok"):
        turned, crank = (mp.mpf(float(own[k])) for own in angles)
        true = (mp.mpf("0.5") + mp.mpc(*pin(lengths, crank - turned))) * mp.expj(turned)
        missed = abs(complex(true - mp.mpc(*map(mp.mpf, C[k].tolist()))))
        assert missed <= 1.5 * result.bound.length[k]


def test_decimals_say_what_they_are() -> None:
    """A pin 1e-8 beside a bar makes it 1.7e-16 longer: less than the last places of the lengths.

    As 0.1 + 0.8 = 0.3 + 0.6 the branches pass each other. Where an expression computes 0.3 its last
    places are not known, and it stays open.
    """
    kept = {}
    for b in (0.3, "0.1 + 0.2"):
        given = four_bar(0.1, 0.3, 0.6, 0.8, crank=0.5, coupler=0.3, rocker=1.0)
        beside = md.Body("coupler", {"B": (0, 0), "C": ("b", 1e-8)})
        bodies = {**given.bodies, "coupler": beside}
        result = swept(replace(given, bodies=bodies, parameters={"b": b}))
        kept[b] = set(result.status[AT > HALF])
    assert kept == {0.3: {"ok"}, "0.1 + 0.2": {"ambiguous"}}


def test_what_rounding_leaves_open_stays_so() -> None:
    """Lengths that meet as decimals, and not as float64; lengths that an expression rounds."""
    for lengths in ((0.1, 0.3, 0.6, 0.8), (0.1, 0.3, 0.7, 0.9)):
        a, b, c, d = map(mp.mpf, lengths)
        assert a + d - b - c != 0
        result = swept(four_bar(*lengths, crank=0.5, coupler=0.3, rocker=1.0))
        assert set(result.status[AT > HALF]) == {"ambiguous"}
    longer = 3 + 9e-16
    given = four_bar(1, longer, 1, 3, crank=1.0, coupler=0.0, rocker=1.0)
    bodies = {**given.bodies, "coupler": md.Body("coupler", {"B": (0, 0), "C": ("b", 0)})}
    computed = replace(given, bodies=bodies, parameters={"b": "3 + 9e-16"})
    assert computed.values()["b"] == longer
    assert set(swept(given).status) == {"ok"}
    assert set(swept(computed).status[AT > HALF]) == {"ambiguous"}
