"""Random mechanisms through the page's modules: nothing is certified there that Python refutes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from tests.attack import page_dimensions, page_honesty
from tests.reference.planar_closure import Closure
from tests.reference.truth.drawing import draw
from tests.reference.truth.judging import swept
from tests.shared.node import needs_node
from tests.shared.player import Player

ROOT = Path(__file__).parents[2]


@needs_node
@pytest.mark.parametrize("start", [0, 320], ids=["any", "rack"])
def test_nothing_is_certified_that_python_refutes(start):
    """Of seed 320 a rack on the crank is elsewhere after whole turns of it."""
    found = page_honesty.chunk(start, 6, sets=3)
    assert found["faults"] == []
    assert found["certified"] > 40
    assert found["sets"] > 10
    assert found["set_poses"] > 300
    assert found["unsure"] == 0


@needs_node
def test_a_limit_position_is_that_of_the_group_that_opens_first(tmp_path):
    """Of seed 206 a cylinder would reach its end 2e-5 m after the legs of a platform open."""
    case = draw(206)
    page = md.page(md.Problem(case.mechanism(), {"sweep": swept(case, 24)}))
    theta = page_dimensions.sets_of(206, page.data["sliders"], case.scale, 13)[-1]
    row = page_honesty.nothing()
    with Player(tmp_path) as player:
        [found] = page_dimensions.shown(page, player, [theta])
    assert page_dimensions.judged(case, page, found, row) == []
    assert row["set_limits"] == 2
    assert row["worst_limit"] < 1e-12


@needs_node
def test_a_limit_position_is_found_where_another_group_hangs_on_it(tmp_path):
    """A step of the group that opens is wild; groups behind it are looked at without it."""
    page = md.page("jansen-leg")
    theta = [
        0.03380387852724916,
        0.03895555064744375,
        0.03766827635982374,
        0.040823443311580124,
        0.05003561129051691,
        0.043473579172601924,
        0.034047234211548656,
        0.06616367390439104,
        0.047309470930366075,
        0.04831260867468459,
        0.0680079373936367,
        0.008528649310890795,
        0.015397450193660785,
    ]
    with Player(tmp_path) as player:
        [t, *ends] = player.asks(
            page,
            f"""
            const t = session.dimension({json.dumps(theta)});
            return [t, ...session.motion.ends.map((end) => [end.s, end.kind])];""",
        )
    names = [own["name"] for own in page.data["sliders"]]
    truth = md.solve("jansen-leg", page.data["task"], set=dict(zip(names, theta, strict=True)))
    assert t == 1
    for (s, kind), wanted in zip(ends, truth.summary["limits"], strict=True):
        assert kind == "limit"
        assert s == pytest.approx(wanted, abs=1e-12)


@needs_node
def test_planted_mistakes_are_refuted(tmp_path, monkeypatch):
    """Of a triad at other dimensions: a pose beside, one of another mode, a limit elsewhere."""
    monkeypatch.setattr(page_dimensions, "FINER", (512,))
    case = draw(20)
    page = md.page(md.Problem(case.mechanism(), {"sweep": swept(case, 24)}))
    sliders = page.data["sliders"]
    theta = page_dimensions.sets_of(20, sliders, case.scale, 1)[0]
    with Player(tmp_path) as player:
        [found] = page_dimensions.shown(page, player, [theta])
        label = next(mode["label"] for mode in page.data["modes"] if not mode["own"])
        chosen = f"session.choose({label!r});" + page_dimensions.ASKED
        for word, value in (*page_dimensions.SHARES.items(), ("LONGEST", 1e6)):
            chosen = chosen.replace(word, json.dumps(value))
        [other] = player.asks(page, chosen.replace("THETAS", json.dumps([theta])))

    def faults(change):
        copy = json.loads(json.dumps(found))
        change(copy)
        row = page_honesty.nothing()
        return " ".join(page_dimensions.judged(case, page, copy, row))

    def beside(own):
        own["poses"][3]["angles"]["crank"] += 1e-6

    def elsewhere(own):
        own["ends"] = [end and {**end, "s": end["s"] + 1e-6} for end in own["ends"]]

    def leaps(own):
        there = next(k for k, pose in enumerate(other["poses"]) if pose["plain"])
        own["poses"][there] = other["poses"][there]

    def longer(own):
        own["theta"][0] += 1e-6 * case.scale

    assert any(found["ends"])
    assert faults(lambda own: None) == ""
    assert "the solution is" in faults(beside)
    assert "the fold is at" in faults(elsewhere)
    assert "sign" in faults(leaps) or "arrive" in faults(leaps)
    assert "the solution is" in faults(longer)


@needs_node
def test_near_a_cusp_page_and_python_are_as_far_from_the_truth(tmp_path):
    """`double-watt` at a condition number of 3600: rounding, and no more than that explains."""
    name = "double-watt"
    page, mechanism = md.page(name), md.load(name).mechanism
    result = md.solve(name, page.data["task"])
    driver = page.data["driver"]["name"]
    s, speed = (getattr(result.drivers[driver], own)[:4] for own in ("position", "velocity"))
    joints = [(own.kind, key, own.first, own.second, {}) for key, own in mechanism.joints.items()]
    closure = Closure(list(mechanism.bodies), joints, driver, mechanism.values())
    q = np.zeros((4, 3 * len(closure.bodies)))
    for k, body in enumerate(closure.bodies):
        point = next(iter(mechanism.bodies[body].points))
        arm = complex(*(closure.numbers[f"{body}.{point}.{axis}"] for axis in "xy"))
        angle, place = result.bodies[body].angle[:4], result.points[f"{body}.{point}"].position[:4]
        origin = place[:, 0] + 1j * place[:, 1] - np.exp(1j * angle) * arm
        q[:, 3 * k : 3 * k + 3] = np.stack([origin.real, origin.imag, angle], 1)
    _, second = closure.rates(closure.solved(q, s), s)
    truth = second[:, 2::3].astype(float) * speed[:, None] ** 2
    asked = """const own = data.entries.filter((e) => e.kind === "bodies");
    return PLACES.map((s) => {
      const pose = session.motion.pose(s);
      const told = own.map((e) => [e.part, ...session.inTime(pose, e.columns, 2)]);
      return [session.motion.condition(pose), Object.fromEntries(told)];
    });""".replace("PLACES", json.dumps(s.tolist()))
    with Player(tmp_path) as player:
        found = player.asks(page, asked)
    for k, (condition, turning) in enumerate(found):
        size = np.abs(truth[k]).max()
        allowed = 2.0**-52 * condition**2
        own = [turning[body] for body in closure.bodies]
        python = [result.bodies[body].angular_acceleration[k] for body in closure.bodies]
        assert condition > 1500
        assert np.abs(own - truth[k]).max() < 0.1 * allowed * size
        assert np.abs(python - truth[k]).max() < 0.1 * allowed * size


def read(name):
    return json.loads((ROOT / f"docs/data/{name}.json").read_text(encoding="utf-8"))


def test_the_long_run_found_nothing():
    figures = read("page-honesty")
    assert figures["faults"] == []
    text = (ROOT / "docs/theory/evidence/live-page.md").read_text(encoding="utf-8")
    for word in ("mechanisms", "live", "certified", "sets"):
        assert f"{figures[word]} {word}" in text
    assert f"{figures['set_poses']} poses anew" in text
    assert f"{figures['set_limits']} limit positions are folds" in text
    assert figures["sets"] + figures["live"] > 6000
    assert figures["unsure"] == figures["missing"] == 0
    assert max(figures["worst_limit"], figures["worst_gap"]) < 1e-9
    assert f"of which {len(figures['untrusted'])} do not trust themselves" in text
    later = figures["further"]
    assert later["faults"] == []
    assert later["unsure"] == 0
    assert max(later["worst_limit"], later["worst_gap"]) < 1e-9
    assert f"{later['sets']} sets and {later['set_poses']} poses, none refuted" in text
    assert f"{later['missing']} pose that Python has was missing" in text


def test_drivers_moved_at_random_are_those_of_python():
    figures = read("page-drivers")["summary"]
    text = (ROOT / "docs/theory/evidence/live-page.md").read_text(encoding="utf-8")
    assert figures["other"] == 0
    assert figures["worst"] < 1e-9
    assert f"{figures['sets']} sets of dimensions, with each" in text
    assert f"{figures['poses']} poses are those of Python, {figures['ended']} ways end" in text


def test_who_opens_no_page_pays_nothing_for_it():
    text = (ROOT / "docs/theory/evidence/live-page.md").read_text(encoding="utf-8")
    for name, own in read("page-cost").items():
        assert own["ratio"] <= 1.05
        assert f"`{name}` {own['ratio']:.2f}" in text


def test_the_measured_pages_are_as_good_as_the_page_says():
    """The committed figures hold what is asked of pages, and the documentation repeats them."""
    numbers, bars, browsers = read("page-numbers")["summary"], read("page-bars"), read("browsers")
    text = (ROOT / "docs/theory/evidence/live-page.md").read_text(encoding="utf-8")
    assert numbers["trusted"] == numbers["live"]
    assert numbers["differ"] == numbers["other"] == numbers["unnamed"] == 0
    assert max(numbers["gap"], numbers["position"]) < 1e-12
    assert numbers["over"] < 1  # the bars, and what rounding makes of the condition number
    assert max(numbers["limit"], numbers["limits_apart"]) < 1e-9
    assert f"all {numbers['live']} live pages" in text
    assert f"{numbers['compared']} poses compared" in text
    for own in bars["pages"].values():
        assert own["bytes"] <= 200_000
        assert own["said"] == own["small"] == []
        assert own["too_wide_320"] == own["too_wide_390"] == 0
        assert own.get("axe", {}) == {}
    assert bars["summary"]["axed"] == bars["summary"]["pages"] == len(bars["pages"])
    assert bars["summary"]["letters"] <= 0.05
    assert f"{100 * bars['summary']['letters']:.0f} % of the frames" in text
    assert bars["summary"]["small_frame_ms"][1] < 16  # 60 frames a second, to eight links
    assert bars["summary"]["small_played"] > 59
    assert f"{bars['summary']['pages']} pages" in text
    for own in browsers:
        assert own["worst"] < 1e-12
        assert own["said"] == {}
        assert own["not_as_python"] == own["empty"] == []
        assert f"{own['browser']}, {own['pages']} pages" in text
        drawn = own["editor"].get("drawn", {}).values()
        assert all(row["worst"] < 1e-12 and row["seconds"] < 60 for row in drawn)
