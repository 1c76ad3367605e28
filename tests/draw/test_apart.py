"""Groups drawn apart, plans of one group, arcs of angles: read back from the axes."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.errors import InputError, UnknownName

LENGTHS = {"OA": 0.1716, "BC": 0.5179, "BE": 0.54, "EF": 0.3013}
"""Of article 000 [m]."""
E = np.array([0.725, 0.263])
"""Its place of E, and of F."""
F = np.array([0.8727, 0.0])


@cache
def pose() -> Any:
    return md.solve("gorshkov-seven-link", "pose")


def marks(axes: Any) -> dict[str, list[Any]]:
    """Return what is drawn by its identifier."""
    found: dict[str, list[Any]] = {}
    for artist in [*axes.patches, *axes.lines, *axes.texts]:
        found.setdefault(str(artist.get_gid()), []).append(artist)
    return found


def middle(artist: Any) -> Any:
    return np.array(artist.get_center())


@pytest.mark.parametrize("dark", [False, True])
def test_groups_apart_are_to_one_scale_with_their_outer_pairs(dark: bool) -> None:
    axes = md.plot(pose(), "groups", dark=dark)
    found = marks(axes)
    texts = [text.get_text() for text in axes.texts]
    for name in ("I(1)", "II.3 RPR(2,3)", "II.2 RRP(4,5)", "II.1 RRR(6,7)"):
        assert name in texts
    assert texts.count("class II, order 2") == 3
    outer = {gid for gid in found if gid.startswith("outer-")}
    assert outer == {f"outer-{name}" for name in ("O", "A", "G", "BC", "guide", "BE", "F")}
    rings = {gid: middle(found[gid][0]) for gid in outer - {"outer-guide"}}
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert all(left < x < right and low < y < high for x, y in rings.values())
    pin = middle(found["joint-E-pin"][0])
    assert np.hypot(*(pin - rings["outer-F"])) == pytest.approx(LENGTHS["EF"])
    assert np.hypot(*(pin - rings["outer-BE"])) == pytest.approx(LENGTHS["BE"])
    slider = middle(found["joint-C-pin"][0])
    assert np.hypot(*(slider - rings["outer-BC"])) == pytest.approx(LENGTHS["BC"])
    # the same pin B is drawn with each of the groups that hang on it
    assert np.hypot(*(rings["outer-BC"] - rings["outer-BE"])) > LENGTHS["EF"]
    letters = [text.get_text() for text in axes.texts]
    assert letters.count("B") == 3


def test_one_group_and_its_pictures_are_named_by_a_beginning() -> None:
    axes = md.plot(pose(), "groups", group="II.1", lang="ru")
    texts = [text.get_text() for text in axes.texts]
    assert "класс II, порядок 2" in texts
    assert "II.3 RPR(2,3)" not in texts
    with pytest.raises(UnknownName, match="group"):
        md.plot(pose(), "groups", group="II")


def test_all_planar_groups_are_drawn_apart() -> None:
    """Wheels, cams, slots, welds, cylinders, groups of class III, without a word of failure."""
    for name in ("geared-five-bar", "wankel-rotor", "planetary-gear-train", "scotch-yoke",
                 "oscillating-cylinder", "double-watt", "cam-roller-follower",
                 "sarich-engine"):  # fmt: skip
        problem = md.load(name)
        task = next(own for own, task in problem.tasks.items() if task.kind == "sweep")
        result = md.solve(problem, task, poses=5)
        axes = md.plot(result, "groups", pose=2)
        texts = {text.get_text() for text in axes.texts}
        assert {own["name"] for own in result.summary["groups"]} <= texts


def test_plans_of_one_group_hold_its_vectors_alone() -> None:
    """Figs. 4 to 7 of the article: group by group, with the Coriolis acceleration by its name."""
    axes = md.plot(pose(), "plans", which="acceleration", group="II.3")
    found = marks(axes)
    texts = [text.get_text() for text in axes.texts]
    assert r"$\mathbf{a}_{A_{3}A}^{k}$" in texts
    assert "Acceleration plan, II.3 RPR(2,3)" in texts
    assert not any("coupler" in gid or "slider" in gid for gid in found)
    page = md.plot(pose(), "plans", group="II.1")
    panels = page.get_figure().axes
    titles = [text.get_text() for axes in panels for text in axes.texts]
    assert "Velocity plan, II.1 RRR(6,7)" in titles
    assert "class II, order 2" in titles
    with pytest.raises(InputError, match="whole mechanism"):
        md.plot(md.solve("slider-crank-friction", "cycle", poses=5), "plans", which="lever",
                group="II.2")  # fmt: skip


def test_arcs_have_the_angles_of_the_article() -> None:
    axes = md.plot(pose(), "diagram", angles=["all", "delta=rocker.angle", "gamma=coupler"])
    found = marks(axes)
    texts = [text.get_text() for text in axes.texts]
    assert {"δ", "γ", "φ"} <= set(texts)
    # the slider lies along x: no arc; the others have those of explanations
    assert {gid for gid in found if gid.startswith("angle-") and not gid.endswith("side")} == {
        "angle-δ", "angle-γ", "angle-φ1", "angle-φ2", "angle-φ3", "angle-φ4",
    }  # fmt: skip
    arc = found["angle-δ"][0].get_xydata()
    turn = np.arctan2(*(arc[-1] - F)[::-1])
    assert turn == pytest.approx(np.arctan2(*(E - F)[::-1]), abs=2e-3)
    assert np.hypot(*(arc - F).T) == pytest.approx(np.hypot(*(arc[0] - F)))
    with pytest.raises(UnknownName, match="rokcer"):
        md.plot(pose(), "diagram", angles=["rokcer"])
    with pytest.raises(InputError, match="no angle"):
        md.plot(pose(), "diagram", angles=["slot.slide"])
    with pytest.raises(InputError, match="spatial"):
        md.plot(md.solve("rssr", poses=3), "diagram", angles=["all"])
