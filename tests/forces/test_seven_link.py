"""Forces of the seven-link mechanism against free bodies of its links, group by group."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.plans.forces import force_plans
from tests.reference.force_truth import Forces, seven_link


def free_bodies(result: md.Result, friction: bool) -> Forces:
    return seven_link(result.drivers["crank.angle"].position, friction=friction).solve(friction)


@pytest.mark.parametrize("task", ["pose", "frictionless", "stroke"])
def test_forces_are_those_of_free_bodies(task: str) -> None:
    poses = {"poses": 12} if task == "stroke" else {}
    result = md.solve("seven-link-forces", task, **poses)
    bodies = free_bodies(result, task != "frictionless")
    assert set(result.status) == {"ok"}
    close = {"rtol": 1e-12, "atol": 0.0}
    np.testing.assert_allclose(result.efforts["crank.angle"], bodies["T"], **close)
    for name in bodies.scene.joints:
        if name == "T":
            continue
        reaction, truth = result.joints[name].reaction, bodies.reaction(name)
        assert np.abs(reaction - truth).max() <= 1e-12 * np.abs(truth).max(), name
        if task != "frictionless":
            np.testing.assert_allclose(result.joints[name].loss, bodies.loss(name), rtol=1e-11)
    if task != "frictionless":  # with friction the crank has to do more, whichever way links move
        without = free_bodies(result, friction=False)["T"]
        assert np.all(np.abs(bodies["T"]) > np.abs(without))
        np.testing.assert_allclose(result.value("efforts_uncoupled/crank.angle"), without, **close)


def test_force_polygons_close_group_by_group_with_the_forces_of_free_bodies() -> None:
    result = md.solve("seven-link-forces", "pose")
    scene = read_scene(result)
    bodies = free_bodies(result, friction=True)
    plans = force_plans(result, scene, 0)
    groups = {name: plan for plan in plans for name, _ in plan.relations}
    assert list(groups) == ["II.1 RRR(6,7)", "II.2 RRP(4,5)", "II.3 RPR(2,3)", "I(1)"]
    links = {"II.1 RRR(6,7)": ("coupler", "rocker"), "II.2 RRP(4,5)": ("connecting_rod", "slider"),
             "II.3 RPR(2,3)": ("block", "rod"), "I(1)": ("crank",)}  # fmt: skip
    for name, plan in groups.items():
        drawn = {a.gid.split("-", 2)[2]: np.subtract(a.end, a.start) for a in plan.arrows}
        expected = {}
        for body in links[name]:
            mass = bodies.scene.masses[body]
            expected[f"{body}-weight"] = mass.mass * bodies.scene.gravity
            expected[f"{body}-inertia"] = -mass.mass * mass.acceleration
            for joint, pair in bodies.scene.joints.items():
                if joint != "T" and body in (pair.first, pair.second):
                    sign = 1 if body == pair.second else -1
                    x, y, _ = sign * bodies.reaction(joint)[0]
                    expected[f"{body}-{joint}"] = x + 1j * y
        expected["slider-load"] = next(f for b, _, f, _ in bodies.scene.loads if b == "slider")
        size = max(abs(complex(*arrow)) for arrow in drawn.values())
        assert {"rod-BC", "rod-BE", "rod-G"} <= set(drawn) or name != "II.3 RPR(2,3)"
        for word, arrow in drawn.items():
            assert abs(complex(*arrow) - expected[word]) <= 1e-12 * size, (name, word)
        outer = [np.subtract(a.end, a.start) for a in plan.arrows if a.kind != "inner"]
        assert np.hypot(*sum(outer)) <= 1e-12 * size


def test_one_group_is_drawn_by_the_beginning_of_its_name() -> None:
    result = md.solve("seven-link-forces", "pose")
    axes = md.plot(result, "plans", which="force", group="II.3")
    assert "Forces on II.3 RPR(2,3)" in {text.get_text() for text in axes.texts} | {
        axes.get_title(), axes.get_title("left")
    }  # fmt: skip
    with pytest.raises(md.UnknownName, match="RRP"):  # the beginning of three of them
        md.plot(result, "plans", which="force", group="II")
