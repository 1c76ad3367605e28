"""The articles: reference values by independent arithmetic, and the page about them.

``data/seed-a-truth.csv`` and ``data/seed-c-truth.csv`` are poses of the two mechanisms
computed with 40 digits from the loop equations, ``data/seed-a-printed.csv`` the numbers of
article 000 with their true values to 12 digits.
"""

from __future__ import annotations

import csv
import importlib.util
import sys
from fractions import Fraction
from functools import cache

import article_friction
import article_geared
import article_seven_link
import article_text
import numpy as np
import pytest

import mechdae as md
from tests.shared.paths import DATA, DOCS

SCRIPT = DOCS / "make_articles.py"
SEVEN, FIVE = "gorshkov-seven-link", "geared-five-bar"


def rows(name):
    with (DATA / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def turned(angle):
    """Return the angle less whole turns, in [-pi, pi)."""
    return np.mod(np.asarray(angle) + np.pi, 2 * np.pi) - np.pi


# -- the page ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("make_articles", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def test_page_is_up_to_date(script, capsys):
    assert script.main(["--check"]) == 0, capsys.readouterr().err


def test_check_reports_a_changed_line(script, monkeypatch, tmp_path, capsys):
    page = script.PAGE.read_text(encoding="utf-8")
    other = tmp_path / "articles.md"
    monkeypatch.setattr(script, "PAGE", other)
    monkeypatch.setattr(script, "page", lambda: page)
    assert script.main(["--check"]) == 1  # no file yet
    other.write_text(page.replace("0.135006627601", "0.135006627602"), encoding="utf-8")
    capsys.readouterr()
    assert script.main(["--check"]) == 1
    assert capsys.readouterr().err.count("should be") == 1
    assert script.main([]) == 0
    assert other.read_text(encoding="utf-8") == page


def test_page_has_every_printed_number_with_its_true_value(script):
    shown = [row for group in article_seven_link.PRINTED.values() for row in group]
    ours = article_seven_link.quantities(md.solve(SEVEN, "pose"))
    for row in rows("seed-a-printed.csv"):
        truth = float(row["truth"])
        matching = [
            s
            for s in shown
            if float(s.printed) == float(row["printed"])
            and abs(ours[s.key] - truth) <= 1e-11 * abs(truth)
        ]
        assert matching, row
        if row["drawn"]:
            assert any(s.drawn and float(s.drawn) == float(row["drawn"]) for s in matching), row


@pytest.mark.parametrize(
    ("printed", "true", "expected"),
    [
        ("0.135", 0.1354999, "exact to print"),
        ("0.135", 0.1355001, "rounding"),
        ("1.584", 1.5859, "rounding"),
        ("1.584", 1.5861, "**deviates**"),
        ("-0.28", -0.2993, "**deviates**"),  # within two units, but 6 %
        ("2", 2.4, "exact to print"),
    ],
)
def test_verdict(script, printed, true, expected):
    assert article_text.verdict(printed, true) == expected


def test_numbers_of_the_page_do_not_feel_noise(script):
    for value in (0.123456789012, 1.0000000000005, 0.1 + 0.2, 123.4565, 5e-14):
        assert article_text.text(value) == article_text.text(value * (1 + 1e-15))


def test_largest_crank_turn_over_one_wheel_turn(script):
    top, bottom, where = article_geared.biggest_turn()
    assert top == pytest.approx(3.71548793636650434, abs=1e-12)
    assert bottom == pytest.approx(2.56769737081308213, abs=1e-12)
    assert where == pytest.approx(9.62150285, abs=1e-7)


# -- article 000 -------------------------------------------------------------------------------

A2 = {
    "points/crank.A/position": (0.1350066276008262, 0.1059234181088008),
    "points/crank.A/velocity": (0.4236936724352033, -0.5400265104033048),
    "points/crank.A/acceleration": (-2.160106041613219, -1.694774689740813),
    "bodies/rod/angle": np.radians(76.76068421306099),
    "bodies/rod/angular_velocity": -0.9094300234475473,
    "bodies/rod/angular_acceleration": 1.585960054950862,
    "joints/slot/slide": 0.5895,
    "joints/slot/slide_velocity": -0.4286398271063013,
    "joints/slot/slide_acceleration": -1.656882375919885,
    "points/rod.B/position": (0.1910475466405585, 0.3441197770087264),
    "points/rod.B/velocity": (0.7384832042519739, -0.1737443748209195),
    "points/rod.B/acceleration": (-1.445853300999707, -0.368605020190205),
    "bodies/connecting_rod/angle": np.radians(-41.64031081512001),
    "bodies/connecting_rod/angular_velocity": 0.4489024365930692,
    "bodies/connecting_rod/angular_acceleration": 0.7731972137209716,
    "points/slider.C/position": (0.5780901658331538, 0.0),
    "points/slider.C/velocity": (0.8929594106310548, 0.0),
    "points/slider.C/acceleration": (-1.257775121431727, 0.0),
    "points/coupler.E/position": (0.7248480217071051, 0.2625290127107428),
    "points/coupler.E/velocity": (0.837098893345404, 0.4714401891431272),
    "points/coupler.E/acceleration": (-2.981582113628877, -5.194942871418265),
    "bodies/coupler/angle": np.radians(-8.690331233358717),
    "bodies/coupler/angular_velocity": 1.208662401215762,
    "bodies/coupler/angular_acceleration": -9.264755574053645,
    "bodies/rocker/angle": np.radians(119.3874888146891),
    "bodies/rocker/angular_velocity": -3.18859574681648,
    "bodies/rocker/angular_acceleration": 17.08311873533926,
}
LOWER_A2 = {
    "points/coupler.E/position": (0.5736717626463607, -0.03692970708217903),
    "bodies/coupler/angular_velocity": -1.674108224433172,
    "bodies/rocker/angular_velocity": 2.72314992359907,
    "bodies/coupler/angular_acceleration": 10.93412548191531,
    "bodies/rocker/angular_acceleration": -15.4137488274776,
}


@cache
def branches():
    """Return the labels of the modes with C on the right, by the side of E."""
    found = md.solve(SEVEN, "modes")
    C, E = (found.points[name].position for name in ("slider.C", "coupler.E"))
    right = [k for k in range(len(found.labels)) if C[k, 0] > 0]
    high = max(right, key=lambda k: E[k, 1])
    low = min(right, key=lambda k: E[k, 1])
    return {"upper": ",".join(found.labels[high]), "lower": ",".join(found.labels[low])}


def assert_close(result, wanted, tolerance):
    for path, value in wanted.items():
        got = np.array(result.value(path)[0])
        error = np.abs(got - value).max()
        assert error <= tolerance * np.linalg.norm(np.atleast_1d(value)), path


def test_seven_link_pose():
    assert_close(md.solve(SEVEN, "pose"), A2, 1e-12)


def test_seven_link_pose_on_the_lower_branch():
    assert_close(md.solve(SEVEN, "pose", mode=branches()["lower"]), LOWER_A2, 1e-12)


def test_seven_link_pose_with_the_articles_slip():
    result = md.solve(SEVEN, "pose", set={"OF": 0.8725})
    w6, w7 = (result.bodies[name].angular_velocity[0] for name in ("coupler", "rocker"))
    e6, e7 = (result.bodies[name].angular_acceleration[0] for name in ("coupler", "rocker"))
    aE = np.hypot(*result.points["coupler.E"].acceleration[0])
    got = [0.54 * w6, -0.3013 * w7, -0.54 * e6, 0.3013 * e7, aE]
    assert got == pytest.approx(
        [0.65154391, 0.9599067, 4.98768863, 5.13222470, 5.97427965], abs=5.1e-9, rel=6e-8
    )


def reach(phi1):
    """Return the distance B-F at a crank angle: the rod is the line from G through A."""
    p = md.load(SEVEN).mechanism.values()
    A = p["OA"] * np.exp(1j * phi1)
    G = -1j * p["OG"]
    B = G + p["GB"] * (A - G) / abs(A - G)
    return abs(B - p["OF"]) - (p["BE"] + p["EF"])


def bisection(function, a, b):
    fa = function(a)
    for _ in range(100):
        m = (a + b) / 2
        fm = function(m)
        a, b, fa = (m, b, fm) if (fm > 0) == (fa > 0) else (a, m, fa)
    return (a + b) / 2


def test_seven_link_window():
    result = md.solve(SEVEN, "window")
    inside = np.radians(-21.5)
    ends = [bisection(reach, inside, inside - 2), bisection(reach, inside, inside + 2)]
    assert np.degrees(ends) == pytest.approx([-76.2758435725417, 60.88078612752001], abs=1e-11)
    assert np.degrees(result.summary["limits"]) == pytest.approx(np.degrees(ends), abs=1e-9)
    assert list(result.status[[0, -1]]) == ["limit", "limit"]
    assert set(result.status[1:-1]) == {"ok"}
    driver = result.drivers["crank.angle"].position[[0, -1]]
    assert np.degrees(driver) == pytest.approx(np.degrees(ends), abs=1e-9)
    for event in result.events:
        assert (event["kind"], event["group"], event["joint"]) == (
            "limit",
            ["coupler", "rocker"],
            "E",
        )


def test_seven_link_turn():
    result = md.solve(SEVEN, "turn")
    assert set(result.status) == {"ok"}
    assert not result.events
    assert result.fault is None
    assert result.summary["not_in_scene"] == ["coupler", "rocker"]
    phi1 = result.drivers["crank.angle"].position
    assert len(phi1) == 361
    assert (phi1[0], phi1[-1]) == (0.0, 2 * np.pi)
    p = md.load(SEVEN).mechanism.values()
    rod = p["OA"] * np.exp(1j * phi1) + 1j * p["OG"]
    B = -1j * p["OG"] + p["GB"] * rod / np.abs(rod)
    C = B.real + np.sqrt(p["BC"] ** 2 - B.imag**2)
    assert np.abs(result.points["slider.C"].position[:, 0] - C).max() < 1e-13


def test_seven_link_modes():
    result = md.solve(SEVEN, "modes")
    assert result.summary["count"] == 4
    assert result.summary["proven"]
    C = sorted(result.points["slider.C"].position[:, 0])
    assert pytest.approx([-0.1959950726, -0.1959950726, 0.5780901658, 0.5780901658], abs=1e-9) == C
    below = md.Modes(driver=md.Driver(coordinate="crank.angle", at=(np.pi,)))
    result = md.solve(SEVEN, below)
    assert (result.summary["count"], result.summary["proven"]) == (0, True)
    assert "joint E stays open" in result.fault
    alone = md.Modes(driver=below.driver, outputs=("slider.C",))
    assert md.solve(SEVEN, alone).summary["count"] == 2


POINTS = {"crank.A": "a", "rod.B": "b", "coupler.E": "e"}
ANGLES = {"rod": "3", "connecting_rod": "4", "coupler": "6", "rocker": "7"}


@pytest.mark.parametrize("branch", ["upper", "lower"])
@pytest.mark.parametrize("group", ["turn30", "window12"])
def test_seven_link_rows(group, branch):
    truth = [
        row
        for row in rows("seed-a-truth.csv")
        if row["set"] == group and row["branchE"] in (branch, "")
    ]
    assert len(truth) == 12
    assembled = np.array([row["assembled_67"] == "1" for row in truth])
    at = tuple(float(np.radians(float(row["phi_deg"]))) for row in truth)
    task = md.Sweep(driver=md.Driver(coordinate="crank.angle", at=at, speed="omega1"))
    result = md.solve(SEVEN, task, mode=branches()[branch])
    assert list(result.status) == ["ok" if a else "unassembled" for a in assembled]
    assert np.isfinite(result.condition[assembled]).all()
    tolerance = 1e-11 * np.where(assembled, np.maximum(1, np.nan_to_num(result.condition)), 1)

    def column(name):
        return np.array([float(row[name] or "nan") for row in truth])

    def check(name, got, dyad):
        wanted = np.column_stack([column(n) for n in ([name] if isinstance(name, str) else name)])
        got = np.asarray(got).reshape(wanted.shape)
        if name in ("th3", "th4", "th6", "th7"):
            got = wanted + turned(got - wanted)
        if dyad:
            assert np.isnan(got[~assembled]).all(), name
        keep = assembled if dyad else np.ones(12, bool)
        error = np.abs(got - wanted).max(axis=1)[keep]
        size = np.linalg.norm(wanted, axis=1)[keep]
        assert (error <= tolerance[keep] * size).all(), (name, (error / size).max())

    for point, letter in POINTS.items():
        series, dyad = result.points[point], letter == "e"
        for prefix, values in (
            ("", series.position),
            ("v", series.velocity),
            ("a", series.acceleration),
        ):
            check((f"{prefix}{letter}x", f"{prefix}{letter}y"), values, dyad)
    for body, number in ANGLES.items():
        series, dyad = result.bodies[body], number in "67"
        check("th" + number, series.angle, dyad)
        check("w" + number, series.angular_velocity, dyad)
        check("e" + number, series.angular_acceleration, dyad)
    slot, C = result.joints["slot"], result.points["slider.C"]
    check("s", slot.slide, False)
    check("sd", slot.slide_velocity, False)
    check("sdd", slot.slide_acceleration, False)
    check("cx", C.position[:, 0], False)
    check("vc", C.velocity[:, 0], False)
    check("ac", C.acceleration[:, 0], False)
    if assembled.all():
        assert "failed" not in result.summary
        return
    assert (~assembled).sum() == 8
    assert np.isnan(result.points["rocker.E"].position[~assembled]).all()
    (failed,) = result.summary["failed"]
    lost = np.flatnonzero(~assembled)
    assert (failed["group"], failed["joint"]) == (["coupler", "rocker"], "E")
    assert (failed["from"], failed["to"]) == (at[lost[0]], at[lost[-1]])
    assert "8 of 12 poses do not assemble" in result.fault


# -- article 004 -------------------------------------------------------------------------------

LENGTHS = ("l0", "l1", "l2", "l3")
SETS = {
    "crank-rocker": (0.1, 0.048, 0.09, 0.08),
    "double crank": (0.04, 0.09, 0.08, 0.1),
    "short coupler": (0.1, 0.09, 0.03, 0.08),
    "shortest l3": (0.1, 0.09, 0.08, 0.04),
    "non-Grashof": (0.11, 0.06, 0.05, 0.08),
}
# counts of real roots over all wheel angles, in the order of SETS; the key is i24
COUNTS = {
    "-1": "4 2 2 0/2/4 2/4",
    "-2": "6 4 2 0/2/4 2/4",
    "-1/2": "6 2/4/6 4 0/2/4 4/6",
    "2": "2 4 2 0/2/4 0/2/4",
    "1/2": "2/4 2/4 4 0/2/4 2/4",
    "3": "4 6 2 0/2/4 0/2",
    "1/3": "4 2/4/6 6 2/4 4/6",
    "-3": "8 6 2/4 2/4 4/6",
    "-1/3": "8 2/4 6 0/2/4 4/6",
    "3/2": "2/4 6 4 0/2/4 2/4",
    "2/3": "2/4 4 6 0/2/4 4/6",
}


@cache
def five():
    return md.load(FIVE)


def settings(lengths, i42):
    return dict(zip(LENGTHS, lengths, strict=True)) | {"i42": str(i42)}


def wheel_modes(phi4, lengths=SETS["crank-rocker"], i42=Fraction(-1)):
    task = md.Modes(driver=md.Driver(coordinate="wheel.angle", at=(float(phi4),)))
    return md.solve(five(), task, set=settings(lengths, i42))


def test_geared_modes():
    result = md.solve(FIVE, "modes")
    assert (result.summary["count"], result.summary["proven"]) == (4, True)


def test_geared_swing():
    l0, l1, l2, l3 = SETS["crank-rocker"]
    far, near = (np.arccos((l0**2 + l3**2 - d**2) / (2 * l0 * l3)) for d in (l1 + l2, l2 - l1))
    result = md.solve(FIVE, "turns")
    assert set(result.status) == {"ok"}
    assert result.summary["swing"]["rocker"] == pytest.approx(far - near, rel=1e-12)
    assert result.summary["swing"]["rocker"] == pytest.approx(1.3209001967791329, rel=1e-12)


@pytest.mark.parametrize("assembly", ["+", "-"])
def test_geared_rows(assembly):
    truth = [row for row in rows("seed-c-truth.csv") if row["assembly"] == assembly]
    assert len(truth) == 16
    start = float(truth[0]["phi1"])
    found = md.solve(FIVE, "modes")
    k = int(np.argmin(np.abs(turned(found.bodies["crank"].angle - start))))
    at = tuple(float(j * np.pi / 4) for j in range(16))
    task = md.Sweep(driver=md.Driver(coordinate="wheel.angle", at=at, speed="omega4"))
    result = md.solve(FIVE, task, mode=",".join(found.labels[k]))
    assert set(result.status) == {"ok"}
    for body, n in (("crank", 1), ("coupler", 2), ("rocker", 3)):
        for name, attribute in (
            (f"phi{n}", "angle"),
            (f"dphi{n}_dphi4", "angular_velocity"),
            (f"d2phi{n}_dphi4_2", "angular_acceleration"),
        ):
            wanted = np.array([float(row[name]) for row in truth])
            error = getattr(result.bodies[body], attribute) - wanted
            if attribute == "angle":
                error = error - 2 * np.pi * np.round(error[0] / (2 * np.pi))
            assert (np.abs(error) <= 1e-12 * np.abs(wanted)).all(), name


def loop(phi1, phi4, lengths, i24):
    """Return how far C is from the circle of the rocker, the coupler turned by the gears."""
    l0, l1, l2, l3 = lengths
    phi2 = float(i24) * phi4 - (float(i24) - 1) * phi1
    return np.abs(l0 + l1 * np.exp(1j * phi1) - l2 * np.exp(1j * phi2)) ** 2 - l3**2


def crank_angles(phi4, lengths, i24):
    """Return all crank angles that close the loop, over the turns the ratio needs."""
    span = 2 * np.pi * i24.denominator
    grid = np.linspace(0, span, 3000 * i24.denominator + 1)
    values = loop(grid, phi4, lengths, i24)
    change = np.flatnonzero(values[:-1] * values[1:] < 0)
    return [
        bisection(lambda a: loop(a, phi4, lengths, i24), grid[k], grid[k + 1]) for k in change
    ], span


@pytest.mark.parametrize("ratio", COUNTS)
@pytest.mark.parametrize("name", SETS)
def test_geared_mode_counts(name, ratio):
    i24, lengths = Fraction(ratio), SETS[name]
    allowed = {int(n) for n in COUNTS[ratio].split()[list(SETS).index(name)].split("/")}
    counts = set()
    for phi4 in 0.3 + np.arange(5) * 2 * np.pi / 5:
        found = wheel_modes(phi4, lengths, 1 / i24)
        wanted, span = crank_angles(phi4, lengths, i24)
        assert found.summary["proven"]
        assert found.summary["count"] == len(wanted), phi4
        if wanted:
            ours = np.mod(found.bodies["crank"].angle, span)
            gaps = np.abs(np.mod(ours[:, None] - wanted + span / 2, span) - span / 2)
            assert gaps.min(axis=0).max() < 1e-9  # every root is a mode
            assert gaps.min(axis=1).max() < 1e-9  # and every mode a root
        counts.add(len(wanted))
    assert counts <= allowed
    if len(allowed) == 1:
        assert counts == allowed


def coupler(phi1, lengths, side):
    """Return the coupler's angle and its derivative by the crank angle."""
    l0, l1, l2, l3 = lengths
    x, y = l0 + l1 * np.cos(phi1), l1 * np.sin(phi1)
    d = np.hypot(x, y)
    phi2 = np.arctan2(y, x) + side * np.arccos((d**2 + l2**2 - l3**2) / (2 * d * l2))
    # derivative of (x - l2 cos phi2)^2 + (y - l2 sin phi2)^2 = l3^2
    cx, cy = x - l2 * np.cos(phi2), y - l2 * np.sin(phi2)
    rate = (cx * y - cy * l1 * np.cos(phi1)) / (l2 * (cx * np.sin(phi2) - cy * np.cos(phi2)))
    return phi2, rate


def wheel_rate(phi1, lengths, i42, side):
    return 1 - float(i42) * (1 - coupler(phi1, lengths, side)[1])


CASES = [
    *(
        ("crank-rocker", i)
        for i in ["-3", "-2", "-1", "-1/2", "-1/3", "1/3", "1/2", "2/3", "3/2", "2", "3"]
    ),
    *(("double crank", i) for i in ["-1", "-2", "-3"]),
]
FAILING = {("crank-rocker", i) for i in ("2/3", "3/2", "2")}
FAILING |= {("double crank", i) for i in ("-2", "-3")}


@pytest.mark.parametrize(("name", "ratio"), CASES)
def test_geared_dead_points(name, ratio):
    lengths, i42 = SETS[name], Fraction(ratio)
    mode = ",".join(wheel_modes(0.0, lengths, i42).labels[0])
    driver = md.Driver(coordinate="wheel.angle", range="assembled", speed="omega4")
    result = md.solve(
        five(), md.Sweep(driver=driver, poses=91), set=settings(lengths, i42), mode=mode
    )
    grid = np.linspace(-np.pi, np.pi, 2001)
    known = []
    for side in (1, -1):
        rate = wheel_rate(grid, lengths, i42, side)
        for k in np.flatnonzero(rate[:-1] * rate[1:] < 0):
            phi1 = bisection(lambda a, s=side: wheel_rate(a, lengths, i42, s), grid[k], grid[k + 1])
            phi2 = coupler(phi1, lengths, side)[0]
            known.append(float(i42) * phi2 + (1 - float(i42)) * phi1)
    assert bool(known) == ((name, ratio) in FAILING)
    phi4 = result.drivers["wheel.angle"].position
    if not known:
        assert result.summary["limits"] == [None, None]
        assert not result.events
        assert set(result.status) == {"ok"}
        turns = np.ptp(phi4) / (2 * np.pi)
        # crank-rocker: the coupler comes back with the crank; double crank: it turns with it
        p, q = i42.denominator, i42.numerator
        wanted = abs(p - q) if name == "crank-rocker" else 1
        assert turns == pytest.approx(wanted, abs=1e-9)
        crank = result.bodies["crank"].angle
        assert abs(np.sin((crank[-1] - crank[0]) / 2)) < 1e-9
        return
    ends = result.summary["limits"]
    assert [event["kind"] for event in result.events] == ["limit", "limit"]
    assert [event["at"] for event in result.events] == ends
    assert list(result.status[[0, -1]]) == ["limit", "limit"]
    n = i42.denominator  # whole turns of crank and coupler shift the wheel by parts of a turn
    for end in ends:
        assert np.abs(turned(n * (np.array(known) - end))).min() < 1e-9


def test_geared_wheel_turns_while_the_crank_rocks():
    lengths, i42 = SETS["short coupler"], Fraction(-1)
    mode = ",".join(wheel_modes(0.0, lengths, i42).labels[0])
    driver = md.Driver(coordinate="wheel.angle", range="assembled", speed="omega4")
    result = md.solve(
        five(), md.Sweep(driver=driver, poses=91), set=settings(lengths, i42), mode=mode
    )
    l0, l1, l2, l3 = lengths
    far, near = (np.arccos((d**2 - l0**2 - l1**2) / (2 * l0 * l1)) for d in (l3 - l2, l3 + l2))
    assert result.summary["limits"] == [None, None]
    assert result.summary["swing"]["wheel"] == pytest.approx(2 * np.pi, rel=1e-12)
    assert result.summary["swing"]["crank"] == pytest.approx(far - near, rel=1e-10)
    assert far - near == pytest.approx(0.708644595519, abs=1e-10)


def test_geared_inequality_of_the_article_is_not_sufficient():
    lengths = (0.075, 0.06, 0.1, 0.07)  # l1 < l3 < l0 < l2, shortest + longest too long
    mode = ",".join(wheel_modes(0.0, lengths).labels[0])
    driver = md.Driver(coordinate="wheel.angle", range="assembled")
    result = md.solve(
        five(), md.Sweep(driver=driver, poses=31), set=settings(lengths, Fraction(-1)), mode=mode
    )
    assert [event["kind"] for event in result.events] == ["limit", "limit"]


# -- article 003 -------------------------------------------------------------------------------

STROKES = {  # r/l, f: largest ratio of losses, (10), P/(P + loss), coupled; 30 digits
    ("1/3", 0.05): (1.01799579322, 0.98632337478812, 0.98650790116718, 0.98630688417877),
    ("1/3", 0.1): (1.036651153, 0.97264674957624, 0.97337502907351, 0.97258015427395),
    ("1/3", 0.2): (1.07609113379, 0.94529349915247, 0.94813106698066, 0.94502187353813),
    ("1/3", 0.4): (1.16471566963, 0.89058699830495, 0.9013775739712, 0.88945534970675),
    ("0.9", 0.05): (1.11512193242, 0.93839710635327, 0.94197181072565, 0.93750415699252),
    ("0.9", 0.1): (1.26019840842, 0.87679421270654, 0.89030880299295, 0.87298061988572),
    ("0.9", 0.2): (1.70342754431, 0.75358842541308, 0.80230320416546, 0.73580600843911),
    ("0.9", 0.4): (5.74371460211, 0.50717685082615, 0.66987171290411, 0.38935309866868),
}


@pytest.mark.parametrize("case", STROKES, ids=lambda case: f"{case[0]}, {case[1]}")
def test_friction_in_the_guide_alone(case):
    run = article_friction.stroke(*case)
    guide, s = run.joints["slide"], run.summary
    middle = len(run) // 2
    found = [guide.loss[middle] / guide.loss_uncoupled[middle]]
    found += [s["efficiency_formula_10"], s["efficiency_uncoupled"], s["efficiency"]]
    assert found == pytest.approx(STROKES[case], rel=1e-9)


@pytest.mark.parametrize(
    ("span", "coupled", "degrees"),
    [
        ((0.02, 0.05), True, 1.85325010277072),
        ((3.08, 3.12), True, 177.149345823584),
        ((0.02, 0.05), False, 1.85575732670454),
        ((3.08, 3.12), False, 177.143576131794),
    ],
)
def test_dead_zones_of_the_slider_that_drives(span, coupled, degrees):
    assert np.degrees(article_friction.dead_zone(*span, coupled)) == pytest.approx(
        degrees, rel=1e-11
    )


CYCLES = {  # losses by (9) and coupled, (10), P/(P + loss), coupled
    "slider-crank-friction": (35.3706079120983, 36.7969095080391, 0.907399965025289,
                              0.915248002919152, 0.912130722520912),
    "slider-crank-inertia": (160.289040608403, 166.007826784596, 0.895091068244518,
                             0.905051965152637, 0.901996405150353),
    "quick-return-friction": (14.4895274554106, 14.7251112302124, 0.769550781846769,
                              0.812711313272148, 0.810244032695944),
    "quick-return-pin": (13.0229911646211, 13.2141726972783, 0.792875361799137,
                         0.828414869810322, 0.826333399845062),
}  # fmt: skip


@pytest.mark.parametrize("name", CYCLES)
def test_cycles_of_the_page(name):
    s = article_friction.cycle(name).summary
    keys = ("loss_uncoupled", "loss", "efficiency_formula_10", "efficiency_uncoupled", "efficiency")
    assert [s[key] for key in keys] == pytest.approx(CYCLES[name], rel=1e-9)


def test_friction_circle_of_the_article():
    s = article_friction.cycle("slider-crank-friction", "article").summary
    assert s["efficiency"] == pytest.approx(0.91187181209931, rel=1e-9)
    assert s["efficiency_formula_10"] == pytest.approx(0.907101827841818, rel=1e-9)
    page = "\n".join(article_friction.formulas())
    assert "0.4988 % at f = 0.1, 1.9804 % at f = 0.2, 4.4031 % at f = 0.3" in page
    assert "11.74077656 rad/s" in page
    assert "−29.7 %" in page
