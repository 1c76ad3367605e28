"""Random mechanisms through the page's modules: nothing is certified there that Python refutes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import mechdae as md
from tests.attack import page_dimensions, page_honesty
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
        for word, shares in page_dimensions.SHARES.items():
            chosen = chosen.replace(word, json.dumps(shares))
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


def read(name):
    return json.loads((ROOT / f"docs/data/{name}.json").read_text(encoding="utf-8"))


def test_the_long_run_found_nothing():
    figures = read("page-honesty")
    assert figures["faults"] == []
    text = (ROOT / "docs/page.md").read_text(encoding="utf-8")
    for word in ("mechanisms", "live", "certified"):
        assert f"{figures[word]} {word}" in text
    assert f"of which {len(figures['untrusted'])} do not trust themselves" in text


def test_the_measured_pages_are_as_good_as_the_page_says():
    """The committed figures hold what is asked of pages, and the documentation repeats them."""
    numbers, bars, browsers = read("page-numbers")["summary"], read("page-bars"), read("browsers")
    text = (ROOT / "docs/page.md").read_text(encoding="utf-8")
    assert numbers["trusted"] == numbers["live"]
    assert numbers["differ"] == numbers["other"] == numbers["unnamed"] == 0
    assert max(numbers["gap"], numbers["position"]) < 1e-12
    assert max(numbers["limit"], numbers["limits_apart"]) < 1e-9
    assert f"all {numbers['live']} live pages" in text
    assert f"{numbers['compared']} poses compared" in text
    for own in bars["pages"].values():
        assert own["bytes"] < 300_000
        assert own["said"] == own["small"] == []
        assert own["too_wide_320"] == own["too_wide_390"] == 0
        assert own["axe"] == {}
    assert bars["summary"]["letters"] <= 0.02
    assert f"{bars['summary']['pages']} pages" in text
    for own in browsers:
        assert own["worst"] < 1e-12
        assert own["said"] == {}
        assert own["not_as_python"] == own["empty"] == []
        assert f"{own['browser']}, {own['pages']} pages" in text
