"""Three engines compared. Truths: closed forms of seals and vanes, areas of chambers."""

from __future__ import annotations

import json
import runpy
import sys
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import mechdae as md
from tests.shared.along_cycle import agrees, mean, root
from tests.shared.paths import DOCS

FOLDER = DOCS / "data" / "engines"
TURNS, OMEGA = 12 * np.pi, 100 * np.pi
PERIOD = TURNS / OMEGA
ROWS = np.radians(np.arange(0, 2161, 2))


@cache
def engine(name: str) -> tuple[md.ReactionsResult, dict, dict]:
    """Return the cycle of an engine, its numbers, and its rows of gas forces as functions."""
    result = md.solve(md.load(FOLDER / f"{name}.toml"), "cycle")
    path = FOLDER / f"{name}.csv"
    titles = path.read_text().split("\n", 1)[0].split(",")
    data = np.loadtxt(path, delimiter=",", skiprows=1).T
    gas = {
        title: (lambda s, y=column: np.interp(np.mod(s, data[0][-1]), data[0], y))
        for title, column in zip(titles[1:], data[1:], strict=True)
    }
    return result, dict(result.mechanism.values()), gas


def with_zeros(*functions) -> list[float]:
    """Return the rows of the files with the places between them at which functions vanish."""
    grid = np.linspace(0, TURNS, 4 * (len(ROWS) - 1) + 1)
    places = set(ROWS.tolist())
    for function in functions:
        v = np.sign(function(grid))
        places |= {root(function, grid[k], grid[k + 1]) for k in np.flatnonzero(v[1:] * v[:-1] < 0)}
    ordered = sorted(places)
    return [a for a, b in pairwise(ordered) if b - a > 1e-12] + [ordered[-1]]


@pytest.mark.slow
def test_rings_of_the_slider_crank() -> None:
    result, n, gas = engine("slider-crank")
    area = n["h_ring"] * np.pi * n["bore"] / 2

    def speed(s):  # the crank stands upwards at 0
        root_ = np.sqrt(n["l"] ** 2 - (n["r"] * np.sin(s)) ** 2)
        return -OMEGA * n["r"] * np.sin(s) * (1 + n["r"] * np.cos(s) / root_)

    def pressure(s):
        return n["tension"] + gas["pressure"](s)

    for k in range(2):
        agrees(result.summary["wear"][f"wall{k}"], pressure, speed, ROWS, PERIOD)
        loss = mean(lambda s: 0.06 * area * pressure(s) * np.abs(speed(s)), ROWS)
        assert result.summary["loss_by_joint"][f"wall{k}"] == pytest.approx(loss, rel=1e-9)
    work = mean(lambda s: -np.pi / 4 * n["bore"] ** 2 * gas["pressure"](s) * speed(s), ROWS)
    assert result.summary["input"] == pytest.approx(work, rel=1e-9)


@pytest.mark.slow
def test_seals_of_the_wankel() -> None:
    result, n, gas = engine("wankel")
    R, e, b, w = n["R"], n["e"], n["b"], OMEGA / 3

    def rate(u):
        return np.sqrt(R**2 + 9 * e**2 + 6 * e * R * np.cos(2 * u))

    for k in range(3):

        def force(s, k=k):
            u = s / 3 + 2 * np.pi * k / 3
            leaning = np.arctan2(3 * e * np.sin(2 * u), R + 3 * e * np.cos(2 * u))
            outwards = -(w**2) * (R - n["d"] + 9 * e * np.cos(2 * u))
            push = n["S"] + b * n["thick"] / 2 * gas[f"across{k}"](s)
            lean = np.cos(leaning) - 0.06 * np.sin(leaning)
            return (push - n["m_seal"] * outwards) / lean

        def pressure(s, k=k, force=force):
            u = s / 3 + 2 * np.pi * k / 3
            curve = (R**2 + 27 * e**2 + 12 * e * R * np.cos(2 * u)) / rate(u) ** 3
            stiff = n["E_contact"] / (2 * np.pi * b)
            return np.sqrt(stiff * force(s) * (1 / n["tip"] - curve))

        def speed(s, k=k):
            return w * rate(s / 3 + 2 * np.pi * k / 3)

        agrees(result.summary["wear"][f"housing{k}"], pressure, speed, ROWS, PERIOD)
        loss = mean(lambda s, f=force, v=speed: 0.06 * f(s) * v(s), ROWS)
        assert result.summary["loss_by_joint"][f"housing{k}"] == pytest.approx(loss, rel=1e-9)

    def power(s):
        along = -np.sin(s) * gas["x"](s) + np.cos(s) * gas["y"](s)
        return np.sqrt(3) * R * b * along * e * OMEGA

    assert result.summary["input"] == pytest.approx(mean(power, ROWS), rel=1e-9)


@pytest.mark.slow
def test_vanes_of_the_orbital_engine() -> None:
    result, n, gas = engine("sarich")
    e, b, w, m, f = n["e"], n["b"], n["w"], n["m_vane"], 0.06
    for k in (0, 3):
        turn = 2 * np.pi * k / 7

        def travel(s, turn=turn):  # of the vane along its slot, and of the face along the foot
            return -e * OMEGA * np.sin(s - turn), e * OMEGA * np.cos(s - turn)

        def state(s, k=k, turn=turn, travel=travel):
            """Normal force of slot and foot, moment in the slot, about its middle."""
            slides, passes = travel(s)
            inertia = -m * e * OMEGA**2 * np.cos(s - turn)
            across, turning = b * gas[f"side{k}"](s), b * gas[f"turning{k}"](s)
            press = 0 * s
            for _ in range(12):  # friction in the slot presses on the foot, and the reverse
                drag = f * np.abs(press) * np.sign(passes)  # the face takes the foot along
                normal = -(across + drag)
                # what acts at the foot lies w inside of the middle of the contact
                moment = w * (across + drag) * -1 + turning
                bearing = np.maximum(np.abs(normal), np.abs(moment) / (n["contact"] / 2))
                press = inertia + f * bearing * np.sign(slides)
            return normal, press, moment, bearing

        guides = (
            lambda s, t=travel: t(s)[0], lambda s, t=travel: t(s)[1],
            lambda s, st=state: st(s)[0], lambda s, st=state: st(s)[1],
            lambda s, st=state: st(s)[2],
            lambda s, st=state: np.abs(st(s)[0]) - np.abs(st(s)[2]) / (n["contact"] / 2),
        )  # fmt: skip
        breaks = with_zeros(*guides)
        wear, losses = result.summary["wear"], result.summary["loss_by_joint"]
        for name, area, index, speed in (
            ("slot", b * n["contact"], 3, 0), ("face", b * n["thick"], 1, 1)
        ):  # fmt: skip

            def pressure(s, state=state, area=area, index=index):
                return np.abs(state(s)[index]) / area

            def sliding(s, travel=travel, speed=speed):
                return travel(s)[speed]

            agrees(wear[f"{name}{k}"], pressure, sliding, breaks, PERIOD)
            loss = f * area * wear[f"{name}{k}"]["mean_pv"]
            assert losses[f"{name}{k}"] == pytest.approx(loss, rel=1e-9)

    def power(s):
        return b * e * OMEGA * (-np.sin(s) * gas["x"](s) + np.cos(s) * gas["y"](s))

    assert result.summary["input"] == pytest.approx(mean(power, ROWS), rel=1e-9)


# -- gas forces by the areas of chambers ------------------------------------------------------


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def by_volumes(volumes, rows, pressure) -> np.ndarray:
    """Return the power of the gas over the shaft's speed at rows, from volumes of chambers.

    `volumes`: angles -> volumes (chambers, n). A chamber is between its smallest volumes of gas
    exchange where `rows` says, four strokes later again.
    """
    fine = np.linspace(0, rows[-1], 20001)
    every = volumes(fine)
    low, high = every.min(), every.max()
    h = 1e-5
    rates = (volumes(rows + h) - volumes(rows - h)) / (2 * h)
    share = np.clip((volumes(rows) - low) / (high - low), 0, 1)
    return (pressure(share) * rates).sum(axis=0)


@pytest.fixture(scope="module")
def script() -> dict:
    sys.path.insert(0, str(DOCS))
    try:
        return runpy.run_path(str(DOCS / "make_engines.py"))
    finally:
        sys.path.remove(str(DOCS))


def diagram(script, strokes):
    """Return share of the volume (chambers, n) -> gauge pressure, by the stroke of each."""

    def pressure(share):
        r, rod = 0.045, 0.145
        down = 2 * r * share
        slide = r + rod - down
        turn = np.degrees(np.arccos(np.clip((r**2 + slide**2 - rod**2) / (2 * r * slide), -1, 1)))
        at = 180 * strokes + np.where(strokes % 2 == 0, turn, 180 - turn)
        return np.vectorize(script["pressure"])(at) - 1e5

    return pressure


def test_gas_on_the_wankel_is_that_of_its_chambers(script) -> None:
    n = script["numbers"]("wankel")
    R, e, b = n["R"], n["e"], n["b"]
    x, weights = np.polynomial.legendre.leggauss(40)

    def volumes(s):
        found = []
        for j in range(3):
            first = s / 3 + 2 * np.pi * j / 3
            u = first + (x[:, None] + 1) * np.pi / 3
            c = np.array([e * np.cos(3 * u) + R * np.cos(u), e * np.sin(3 * u) + R * np.sin(u)])
            d = np.array([-3 * e * np.sin(3 * u) - R * np.sin(u),
                          3 * e * np.cos(3 * u) + R * np.cos(u)])  # fmt: skip
            sector = (weights @ cross(c, d)) * np.pi / 6
            ends = [
                np.array([e * np.cos(s) + R * np.cos(a), e * np.sin(s) + R * np.sin(a)])
                for a in (first, first + 2 * np.pi / 3)
            ]
            found.append(b * (sector - cross(*ends) / 2))  # to the chord: the rotor's arc is fixed
        return np.array(found)

    rows = np.radians(np.arange(1, 1080, 2))
    # strokes: flank j is smallest at the lower and upper waist, fired at the upper one
    turned = np.array([(rows - np.pi / 2 - np.pi * j) / 1.5 for j in range(3)])
    strokes = np.floor_divide(turned, np.pi).astype(int)
    shifted = np.array([strokes[j] + (2 if j % 2 == 0 else 0) for j in range(3)]) % 4
    power = by_volumes(volumes, rows, diagram(script, shifted))
    given = [script["wankel"](s) for s in rows]
    fx, fy = (np.array([row[axis] for row in given]) for axis in "xy")
    own = np.sqrt(3) * R * b * e * (-np.sin(rows) * fx + np.cos(rows) * fy)
    assert own == pytest.approx(power, rel=1e-6, abs=1e-6 * abs(power).max())


def test_gas_on_the_orbiter_is_that_of_its_chambers(script) -> None:
    n = script["numbers"]("sarich")
    e, h, b = n["e"], n["h"], n["b"]

    def volumes(s):
        found = []
        centre = e * np.array([np.cos(s), np.sin(s)])
        for k in range(7):
            turns = [2 * np.pi * k / 7, 2 * np.pi * (k + 1) / 7]
            middle = np.mean(turns)
            one, two = (
                (h + e * np.cos(s - t)) * np.array([[np.cos(t)], [np.sin(t)]]) for t in turns
            )
            corner = centre + h / np.cos(np.pi / 7) * np.array([[np.cos(middle)], [np.sin(middle)]])
            area = (cross(one, corner) + cross(corner, two)) / 2
            found.append(-b * area)  # up to a constant
        return np.array(found)

    rows = np.radians(np.arange(1, 720, 2))
    turned = np.array([rows - (2 * k + 1) * np.pi / 7 for k in range(7)])
    strokes = np.floor_divide(turned, np.pi).astype(int)
    shifted = np.array([strokes[k] + (2 if k % 2 == 0 else 0) for k in range(7)]) % 4
    power = by_volumes(volumes, rows, diagram(script, shifted))
    given = [script["sarich"](s) for s in rows]
    fx, fy = (np.array([row[axis] for row in given]) for axis in "xy")
    own = b * e * (-np.sin(rows) * fx + np.cos(rows) * fy)
    assert own == pytest.approx(power, rel=1e-6, abs=1e-6 * abs(power).max())


def test_files_and_page_are_those_of_the_script(script) -> None:
    for name, (row, cycle) in script["ENGINES"].items():
        lines = (FOLDER / f"{name}.csv").read_text().splitlines()
        assert len(lines) == cycle // 2 + 2
        values = [float(cell) for cell in lines[78].split(",")]
        expected = row(np.radians(2 * 77))
        assert values[1:] == pytest.approx(list(expected.values()), rel=1e-8, abs=1e-6)
    found = json.loads((DOCS / "data" / "engines.json").read_text(encoding="utf-8"))
    page = (DOCS / "theory" / "evidence" / "engines.md").read_text(encoding="utf-8")
    assert script["tables"](found) in page
    volumes = [found[name]["filled"] for name in script["NAMES"]]
    assert volumes == pytest.approx([volumes[0]] * 3, rel=3e-4)
    powers = [found[name]["indicated"] for name in script["NAMES"]]
    assert powers == pytest.approx([powers[0]] * 3, rel=5e-4)


@pytest.mark.slow
def test_the_table_is_that_of_today(script) -> None:
    found = json.loads((DOCS / "data" / "engines.json").read_text(encoding="utf-8"))
    for name in script["NAMES"]:
        summary = engine(name)[0].summary
        assert found[name]["useful"] == pytest.approx(summary["useful"], rel=1e-9)
        for seal, joints in script["SEALS"][name].items():
            for joint in joints:
                wear = summary["wear"][joint]
                assert found[name]["seals"][seal]["peak_pv"] >= wear["peak_pv"] * (1 - 1e-9)
    # accelerations: r w^2 (1 + r/l), the tip of a seal at the long axis, e w^2
    assert found["slider-crank"]["acceleration"] == pytest.approx(
        0.045 * OMEGA**2 * (1 + 45 / 145), rel=1e-9
    )
    n = engine("wankel")[1]
    assert found["wankel"]["acceleration"] == pytest.approx(
        (OMEGA / 3) ** 2 * (n["R"] + 9 * n["e"]), rel=1e-9
    )
    assert found["sarich"]["acceleration"] == pytest.approx(0.0163 * OMEGA**2, rel=1e-9)


@pytest.mark.slow
def test_other_mechanisms_are_ranked_by_what_all_have() -> None:
    files = [md.load(FOLDER / f"{name}.toml") for name in ("slider-crank", "wankel")]
    words = ["loss", "peak_pv", "peak_pressure", "height"]
    ranking = md.rank(files[0], variants=files, criteria=words)
    for row, problem in zip(ranking.rows, files, strict=True):
        wear = engine(problem.name)[0].summary["wear"]
        most = max(contact["peak_pv"] for contact in wear.values())
        assert row.values["peak_pv"] == pytest.approx(most, rel=1e-12)
    assert len(ranking.order) == 2
