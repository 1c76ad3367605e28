"""What is put on paper shows the whole mechanism, whichever outputs its task names."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from typing import Any

import pytest

import mechdae as md
from mechdae.draw.figure import svg_text
from mechdae.errors import InputError

KINDS = ("sweep", "reactions")
OUTPUTS = (("slider.C",), ("rod",), ("slide", "B"))
VARY = {"r_mm": (90, 110, 10)}


def problem(kind: str, outputs: tuple[str, ...] | None) -> Any:
    """Return a slider-crank with loads whose one task, "cycle", names outputs."""
    whole = md.load("slider-crank-friction")
    task: Any = replace(whole.task("cycle"), poses=5, cycle=False, friction="none", outputs=outputs)
    if kind == "sweep":
        task = md.Sweep(**{part.name: getattr(task, part.name) for part in fields(md.Sweep)})
    return replace(whole, expected=()).with_task("cycle", task)


def explained(kind: str, outputs: tuple[str, ...] | None) -> Any:
    return md.explain(problem(kind, outputs), "cycle").data()


def of_result(kind: str, outputs: tuple[str, ...] | None) -> Any:
    result = md.solve(problem(kind, outputs), "cycle").in_units("mm,kN")
    return md.explain(result, units=result.units).text()


def reported(kind: str, outputs: tuple[str, ...] | None) -> Any:
    return md.report(problem(kind, outputs), "cycle", positions=2).typ()


def assigned(kind: str, outputs: tuple[str, ...] | None) -> Any:
    variant = md.assign(problem(kind, outputs), "cycle", vary=VARY, count=1, positions=2)[0]
    assert variant.problem.task("cycle").outputs == outputs
    return variant.sheet.typ(), variant.key.typ()


PAPERS = {make.__name__: make for make in (explained, of_result, reported, assigned)}


@cache
def whole_paper(paper: str, kind: str) -> Any:
    return PAPERS[paper](kind, None)


@pytest.mark.parametrize("outputs", OUTPUTS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("paper", PAPERS)
def test_outputs_of_the_task_change_no_paper(
    paper: str, kind: str, outputs: tuple[str, ...]
) -> None:
    assert PAPERS[paper](kind, outputs) == whole_paper(paper, kind)


def test_joints_and_named_outputs_leave_no_group_out() -> None:
    """The toggle clamp: two dyads and the reactions of all joints, though only joints are named."""
    clamp = md.load("toggle-clamp")
    task: Any = replace(clamp.task("close"), poses=5, find=None, outputs=("guide", "cyl", "amp"))
    whole = md.explain(clamp.with_task("close", replace(task, outputs=None)), "close", pose=2)
    paper = md.explain(md.solve(clamp.with_task("close", task), "close"), pose=2)
    assert paper.data() == whole.data()
    assert all(f" {body}" in paper.text() for body in clamp.mechanism.bodies)


@pytest.mark.parametrize("outputs", OUTPUTS)
@pytest.mark.parametrize("picture", ["diagram", "groups", "plans"])
@pytest.mark.parametrize("kind", KINDS)
def test_outputs_of_the_task_change_no_picture(
    kind: str, picture: str, outputs: tuple[str, ...]
) -> None:
    drawn, whole = (
        svg_text(md.plot(problem(kind, names), picture, task="cycle", pose=1))
        for names in (outputs, None)
    )
    assert drawn == whole


@pytest.mark.parametrize("outputs", [("lower",), ("P",), ()])
def test_outputs_of_a_motion_change_no_picture(outputs: tuple[str, ...]) -> None:
    problem = md.load("double-pendulum")
    motion = next(t for t in problem.tasks.values() if t.kind == "motion")
    motion = replace(motion, until=0.01, poses=3)
    drawn, whole = (
        svg_text(md.plot(problem, "diagram", task=replace(motion, outputs=names), pose=1))
        for names in (outputs, None)
    )
    assert drawn == whole


def test_a_result_without_bodies_says_which_are_missing() -> None:
    result = md.solve(problem("sweep", ("O",)), "cycle")
    with pytest.raises(InputError, match="no loop is closed") as caught:
        md.plot(result, "loops")
    assert caught.value.hint == "a task without outputs: the result has no rod, slider"


def test_no_force_is_an_error_of_its_own() -> None:
    """Weightless links without loads: a report without plans of forces, which plot refuses."""
    driver = md.Driver("crank.angle", from_=0.0, to=1.0, speed=1.0)
    four_bar = md.four_bar(0.1, 0.04, 0.12, 0.08)
    task = md.Reactions(driver=driver, poses=3)
    assert md.report(four_bar, task, positions=2).html()
    with pytest.raises(InputError, match=r"no force acts on II\.1"):
        md.plot(four_bar, "plans", task=task, which="force", group="II.1")
