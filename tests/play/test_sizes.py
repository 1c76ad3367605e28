"""Clearances of any size: a band or null, never an error that says nothing."""

from __future__ import annotations

import json
import math
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from tests.shared.gaps import slider_crank, two_wheels
from tests.shared.paths import ROOT

LOST = "no pose has a proved band"
NOTHING = 1e-12
"""Rounding of what no clearance moves."""
SIZES_MM = (0, 1e-6, 1e-3, 0.1, 1, 4, 8, 9, 9.5, 12, 30, 39.9, 40, 79, 150, 1e6)
"""The crank is 40 mm long, the rocker 80 mm, the coupler 120 mm."""
TASK = """
[tasks.play]
kind = "play"
poses = 37
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360, speed_rpm = 60 }
"""
LOAD = '\n[loads.f]\nkind = "force"\npoint = "coupler.P"\nvalue = [0, -50]\n'


def linkage(size_mm: float, keys: str = "", load: str = "") -> str:
    """Return the file of the manual's first page with clearance in B and C, and a task."""
    found = re.search(r"```toml\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    assert found
    text = found[1]
    for end in ("coupler.B", "rocker.C"):
        text = text.replace(f'"{end}"] }}', f'"{end}"], clearance_mm = {size_mm!r} }}')
    assert text.count("clearance_mm") == 2
    return text + load + TASK + keys


def answers(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str) -> tuple[dict, str, str]:
    """Return what ``--json`` prints of a task, its table, and messages; nothing warns."""
    path = tmp_path / "x.toml"
    path.write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        codes = [main(["solve", str(path), "--task", "play", "--json"])]
        whole, messages = capsys.readouterr()
        codes.append(main(["solve", str(path), "--task", "play"]))
        table, again = capsys.readouterr()
    assert codes[0] == codes[1]
    assert "Warning" not in messages + again
    assert "Traceback" not in messages + again
    if codes[0]:
        return {}, table, again
    return json.loads(whole)["tasks"]["play"], table, again


def check(entry: dict, table: str, messages: str) -> np.ndarray:
    """Check that nulls are where arcs without a band say so; return where there is a band."""
    at = np.array(next(iter(entry["drivers"].values()))["position"])
    arcs = entry["summary"]["play"]["unbounded"]
    lost = np.zeros(len(at), bool)
    for arc in arcs:
        lost |= (arc["from"] <= at) & (at <= arc["to"])
    for point in entry["points"].values():
        assert [b is None for b in point["distance_band"]] == lost.tolist()
    for body in entry["bodies"].values():
        assert [b is None for b in body["angle_band"]] == lost.tolist()
    assert ("no band is proved from" in table) == bool(arcs)
    assert (LOST in messages) == bool(lost.all())
    largest = entry["summary"]["play"]["largest"]
    assert not (lost.all() and largest)
    for each in largest.values():
        assert math.isfinite(each["band"])
        assert not lost[np.argmin(abs(at - each["at"]))]
    return ~lost


def test_a_four_bar_with_gaps_of_any_size(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Larger gaps have wider bands at fewer poses, in the end none, and then are refused."""
    before, wide = np.ones(37, bool), np.zeros(37)
    seen = set[str]()
    for size in SIZES_MM:
        entry, table, messages = answers(tmp_path, capsys, linkage(size))
        if not entry:
            assert size >= 40
            assert "smaller than the link" in messages
            seen.add("refused")
            continue
        assert size < 40
        there = check(entry, table, messages)
        assert (there <= before).all()
        band = np.array(entry["points"]["coupler.P"]["distance_band"], float)
        assert (band[there] >= wide[there]).all()
        before, wide = there, band
        seen.add("all" if there.all() else "some" if there.any() else "none")
        if not size:
            assert band.max() < NOTHING
    assert seen == {"all", "some", "none", "refused"}


@pytest.mark.parametrize("block", [None, 0.02])
def test_a_slider_crank_with_gaps_of_any_size(block: float | None) -> None:
    """Its crank is 100 mm long; a guide may be as loose as it likes, a block in it may not."""
    rest = {} if block is None else {"contact_length": block}
    push = md.Force("push", point="slider.C", value=(-50.0, 0.0))
    seen, refused = set[str](), list[tuple[float, str]]()
    for size in (0.0, 1e-6, 1e-4, 3e-3, 9e-3, 0.03, 0.09, 0.11, 10.0, 1e50):
        base = replace(slider_crank(clearance=size, **rest), loads={"push": push})
        joints = {name: replace(joint, clearance=size) for name, joint in base.joints.items()}
        loose = replace(base, joints={**base.joints, "guide": joints["guide"]})
        for mechanism in (loose, replace(base, joints=joints)):
            driver = md.Driver("crank.angle", from_=0.0, to=2 * np.pi)
            task = md.Play(driver, poses=13, under_load=True)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                try:
                    result = md.solve(mechanism, task)
                except md.MechanismError as error:
                    seen.add("refused")
                    refused.append((size, str(error)))
                    continue
                table, entry = result.table(), json.loads(json.dumps(result.to_dict()))
            there = check(entry, table, " ".join(entry["summary"].get("notes", [])))
            shift = entry["joints"]["guide"]["slide_shift"]
            assert [each is not None for each in shift] == there.tolist()
            seen.add("all" if there.all() else "some" if there.any() else "none")
    assert {"all", "refused"} <= seen
    assert all(re.search("smaller than the link|turn round", text) for _, text in refused)
    assert min(refused)[0] >= (0.01 if block else 0.1)
    assert block or {"some", "none"} <= seen


def test_loads_press_outputs_as_they_press_all(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Outputs choose what is shown of it; forces are those of the whole mechanism."""
    load = "under_load = true\n"
    whole, _, _ = answers(tmp_path, capsys, linkage(0.1, load, LOAD))
    some, table, _ = answers(
        tmp_path, capsys, linkage(0.1, load + 'outputs = ["coupler.P"]\n', LOAD)
    )
    assert list(some["points"]) == ["coupler.P"]
    assert "joints" not in some
    ours, theirs = some["points"]["coupler.P"], whole["points"]["coupler.P"]
    np.testing.assert_allclose(ours["position_shift"], theirs["position_shift"], rtol=1e-9)
    assert np.abs(ours["position_shift"]).max() > 1e-5
    for one, every in zip(
        some["summary"]["play"]["reversals"], whole["summary"]["play"]["reversals"], strict=True
    ):
        assert set(one.pop("lost")) <= {"points/coupler.P/position"}
        assert every.pop("lost")
        assert one == every
    assert "changes sides" in table


def test_outputs_that_no_clearance_moves_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = linkage(0.1, 'outputs = ["crank.B"]\n')
    entry, _, messages = answers(tmp_path, capsys, text)
    assert not entry
    assert "tasks.play.outputs: the outputs depend on no joint with a clearance" in messages


@pytest.mark.parametrize(
    ("size_mm", "keys", "kind"),
    [
        (0.1, "", "band"),
        (9, "", "band"),
        (12, "", "diagram"),
        (12, 'outputs = ["coupler.P"]\n', "diagram"),
        (0.1, 'outputs = ["rocker.angle"]\n', "curves"),
    ],
)
def test_bands_are_drawn_without_a_wish_where_there_are_any(
    size_mm: float, keys: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.toml"
    path.write_text(linkage(size_mm, keys), encoding="utf-8")
    plot = ["plot", str(path), "--task", "play", "--out", str(tmp_path)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(plot) == 0
        assert capsys.readouterr().out.strip() == str(tmp_path / f"x-play-{kind}.svg")
        wish = main([*plot, "--kind", "band"])
    messages = capsys.readouterr().err
    assert "Traceback" not in messages
    assert bool(wish) == ("no band is proved of these points" in messages) == (kind != "band")


def test_wheels_whose_centres_stay_have_curves_of_their_bands() -> None:
    """A band of rounding is none: points of wheels about fixed pins stay where they are."""
    task = md.Play(md.Driver("crank.angle", from_=0.0, to=1.0), poses=3)
    drawn = md.plot(md.Problem(two_wheels(), {"play": task}))
    band = np.degrees(0.5e-4 / 0.04)
    assert any(np.allclose(line.get_ydata(), band, rtol=1e-5) for line in drawn.get_lines())
