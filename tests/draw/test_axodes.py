"""Axodes behind diagrams of spatial mechanisms: where they lie, refusals, the command line."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.draw.space.axodes import rulings
from mechdae.draw.space.spatial_scene import read_spatial
from mechdae.tasks.pictures import for_picture


@cache
def solved(name: str, measures: tuple[str, ...] = ("axodes",)) -> md.Result:
    problem = md.load(name)
    problem = problem.with_task("turn", replace(problem.tasks["turn"], poses=25))
    return for_picture(problem, "turn", ("bodies",), measures=measures)


def test_both_surfaces_touch_along_the_axis_of_the_pose() -> None:
    result = solved("wobble-plate")
    scene = read_spatial(result)
    for pose in (0, 7):
        fixed, moving = rulings(result, scene, ["plate"], pose)
        assert (fixed.kind, moving.kind) == ("fixed", "moving")
        np.testing.assert_allclose(fixed.ends[pose], moving.ends[pose], atol=1e-15)
        apart = np.abs(fixed.ends - moving.ends).max(axis=(1, 2))
        assert np.median(apart) > 0.01  # the cones are different ones


def test_surfaces_are_drawn_behind_the_links() -> None:
    axes = md.plot(solved("wobble-plate"), "diagram", axodes=["plate"])
    lines: dict[str, list] = {}
    for line in axes.lines:
        lines.setdefault(str(line.get_gid()), []).append(line)
    assert len(lines["axode-fixed-plate"]) == len(lines["axode-moving-plate"]) == 25
    assert len(lines["screw-axis-plate"]) == 1
    assert any("plate moving axode dashed" in text.get_text() for text in axes.texts)
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    for line in lines["axode-fixed-plate"]:
        ends = np.array(line.get_data()).T
        assert (ends >= low).all()
        assert (ends <= high).all()


@pytest.mark.parametrize(
    ("name", "options", "text"),
    [
        ("rssp", {"axodes": ["slider"]}, "body slider never turns"),
        ("wobble-plate", {"axodes": ["plat"]}, "did you mean plate"),
        ("wobble-plate", {"axodes": ["rod"]}, "no axodes of 'rod'"),
        ("wobble-plate", {"axodes": ["plate"], "view": "three"}, "drawn in one view"),
    ],
)
def test_what_has_no_axodes_is_named(name: str, options: dict, text: str) -> None:
    with pytest.raises(md.MechdaeError, match=text):
        md.plot(solved(name), "diagram", **options)


def test_a_sweep_without_the_measure_is_told_so() -> None:
    with pytest.raises(md.InputError, match="no axodes of 'plate'") as caught:
        md.plot(solved("wobble-plate", ()), "diagram", axodes=["plate"])
    assert "measures" in caught.value.hint


def test_the_command_line_computes_what_it_draws(tmp_path, capsys) -> None:
    more = ["--out", str(tmp_path), "--axodes"]
    assert main(["plot", "wobble-plate", *more, "plate"]) == 0
    assert (tmp_path / "wobble-plate-turn-diagram-axodes-plate.svg").exists()
    assert (
        main(["plot", "four-bar-crank-rocker", "--axodes", "rocker", "--out", str(tmp_path)]) == 2
    )
    assert "axodes" in capsys.readouterr().err
