"""What Python users meet: names that Tab lists, the vocabulary of all that they call."""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
import inspect
import re
from collections.abc import Callable
from typing import Any

import pytest

import mechdae as md
from mechdae import cli
from mechdae.describe.values import Value
from mechdae.records import Record
from tests.shared.paths import ROOT, document_pages

CLASSES = [
    cls
    for cls in (getattr(md, name) for name in md.__all__)
    if inspect.isclass(cls) and dataclasses.is_dataclass(cls)
]


def listed(thing: object) -> set[str]:
    return {name for name in dir(thing) if name[0] != "_"}


def fields(cls: Any) -> set[str]:
    return {entry.name for entry in dataclasses.fields(cls) if entry.name[0] != "_"}


def test_parts_list_their_fields_and_no_traits() -> None:
    pin = md.Revolute("A", "ground.A", "crank.A")
    numbers = {"friction", "friction_static", "pin_radius", "face_width", "clearance", "limits",
               "restitution"}  # fmt: skip
    assert listed(pin) == {"name", "first", "second"} | numbers
    assert pin.hinge  # what rooms ask is there
    for cls in (cls for cls in CLASSES if issubclass(cls, Record)):
        names = listed(object.__new__(cls))
        assert fields(cls) <= names, cls
        more = names - fields(cls)
        assert len(more) <= (0 if issubclass(cls, Value) else 12), (cls, more)
        assert all(inspect.getdoc(getattr(cls, name)) for name in more), (cls, more)


def test_results_list_what_their_kind_has() -> None:
    result = md.solve("four-bar-crank-rocker", "turn", poses=3)
    names = listed(result)
    assert fields(md.SweepResult) <= names
    others = {name for cls in CLASSES if issubclass(cls, md.Result) for name in fields(cls)}
    assert not names & (others - fields(md.SweepResult) - {"table"})  # of all, as a call
    assert not names & {"codes", "as_kind", "of", "forces", "whole_path", "constructed", "shows"}
    assert not inspect.signature(md.SweepResult).parameters


def test_what_documents_use_is_listed() -> None:
    """Of results, problems and mechanisms in the pages of Python."""
    problem = md.load("four-bar-crank-rocker")
    things: dict[str, Any] = {"result": md.solve(problem, "turn", poses=3), "problem": problem}
    things["mechanism"] = problem.mechanism
    of_kinds = {name for cls in CLASSES if issubclass(cls, md.Result) for name in fields(cls)}
    found = 0
    for path in document_pages():
        text = path.read_text(encoding="utf-8")
        for block in re.findall(r"```python\n.*?```|`[^`\n]+`", text.replace(".py", ""), re.S):
            for name, thing in things.items():
                used = set(re.findall(rf"(?<![\w.]){name}\.([a-z]\w*)", block))
                used -= of_kinds if name == "result" else set()
                assert used <= listed(thing), (path, name)
                found += len(used)
    assert found > 10


# -- one vocabulary ------------------------------------------------------------------------------

FUNCTIONS = {
    "solve": "solve", "plot": "plot", "page": "page", "explain": "explain", "report": "report",
    "assign": "assign", "export": "export", "certify": "certify", "rank": "rank",
    "variants": "variants", "study": "study screen", "synthesize": "synthesize",
}  # fmt: skip
"""Commands and the functions that do the same in Python."""
SHARED = ("set", "mode", "poses", "units", "lang", "task")
"""Options that are called the same in all commands that have them, and in Python."""
TASKLESS = ("plot", "variants", "count_variants", "loops_of")
"""Functions whose second argument is the kind of picture, the way to vary, the problem."""
SOURCES = [name for name in md.__all__ if name[0].islower()]


def parameters(name: str) -> dict[str, inspect.Parameter]:
    return dict(inspect.signature(getattr(md, name)).parameters)


def test_the_problem_is_first_and_the_task_second() -> None:
    count = 0
    for name in SOURCES:
        found = parameters(name)
        if "problem" not in found or name == "check_certificate":
            continue
        count += 1
        order = list(found)
        assert order[0] == "problem", name
        if name not in ("dump", "dumps", *TASKLESS):
            assert order[1] == "task", name
            assert found["task"].kind is inspect.Parameter.POSITIONAL_OR_KEYWORD, name
            assert found["task"].default is None, name
            rest = [found[word] for word in order[2:]]
            named = (inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.VAR_KEYWORD)
            assert all(parameter.kind in named for parameter in rest), name
    assert count > 14


def test_functions_have_the_options_of_their_commands() -> None:
    for command, names in FUNCTIONS.items():
        module = cli.COMMANDS[command].load()
        parser = argparse.ArgumentParser(prog="")
        module.arguments(parser)
        options = {action.dest for action in parser._actions}
        for name in names.split():
            lacks = (set(SHARED) & options) - set(parameters(name))
            # an option of its pictures; a ranking is SI, its table is in units
            lacks -= {"plot": {"lang"}, "rank": {"units"}}.get(name, set())
            assert not lacks, (name, lacks)


PLACES = {
    "name": lambda: "slider-crank-friction",
    "file": lambda: ROOT / "problems" / "slider-crank-friction.toml",
    "problem": lambda: md.load("slider-crank-friction"),
    "result": lambda: md.solve("slider-crank-friction", "cycle", poses=13),
    "mechanism": lambda: md.load("slider-crank-friction").mechanism,
}
FEW = md.Sweep(driver=md.Driver("crank.angle", from_=0.1, to=0.4), poses=3)
CALLS: dict[str, Callable[..., Any]] = {
    "solve": lambda it, task: md.solve(it, task, poses=3),
    "function": lambda it, task: md.function(
        it, task, inputs=["crank.angle"], outputs=["points/rod.C/position"]
    ),
    "certify": lambda it, task: md.certify(it, FEW),
    "study": lambda it, task: md.study(
        it,
        of=None if task is None else "reactions",
        sets={"r": [0.1]},
        outputs=["points/rod.C/position"],
    ),
    "plot": lambda it, task: md.plot(it, task=task),
    "explain": lambda it, task: md.explain(it, task),
    "page": lambda it, task: md.page(it, task),
}


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
def test_all_take_a_name_a_file_a_problem_a_mechanism_or_a_result(place: str) -> None:
    it = PLACES[place]()
    cycle: Any = md.load("slider-crank-friction").tasks["cycle"]
    task = dataclasses.replace(cycle, poses=13, cycle=False) if place == "mechanism" else None
    for name, call in CALLS.items():
        if name == "study" and task is not None:
            continue  # a mechanism has no task that might be repeated
        if name == "certify" and importlib.util.find_spec("flint") is None:
            continue
        assert call(it, task) is not None, name


def test_slips_in_keywords_are_answered_with_the_nearest() -> None:
    slips: dict[str, Callable[[], Any]] = {
        "poses": lambda: md.solve("slider-crank", pose=5),  # type: ignore[call-overload]
        "drivers": lambda: md.Sweep(drivrs=()),  # type: ignore[call-arg]
        "pin_radius": lambda: md.Revolute("A", "a.A", "b.A", pin_radios=1),  # type: ignore[call-arg]
        "units": lambda: md.page("slider-crank", unit="mm"),  # type: ignore[call-arg]
        "pose": lambda: md.explain("slider-crank", poses=3),  # type: ignore[call-arg]
        "ground": lambda: md.Mechanism(grond=None),  # type: ignore[call-arg]
        "traces": lambda: md.plot("slider-crank", "diagram", trace=False),
    }
    for near, call in slips.items():
        with pytest.raises(md.UnknownName) as caught:
            call()
        assert near in caught.value.hint, near
        assert isinstance(caught.value, TypeError) or near == "traces"


def test_names_and_orders_of_earlier_versions_warn() -> None:
    problem = md.load("four-bar-crank-rocker")
    with pytest.warns(DeprecationWarning, match="exported is called export now"):
        old = md.exported  # type: ignore[attr-defined]
    made = md.export(problem, "turn", format="urdf")
    assert old(problem, "urdf", "turn").files == made.files
    path = ["points/coupler.P/position"]
    with pytest.warns(DeprecationWarning, match=r"function\(problem, inputs=..., outputs=...\)"):
        again = md.function(problem, ["crank.angle"], path)  # type: ignore[misc, arg-type]
    assert again is md.function(problem, inputs=["crank.angle"], outputs=path)
    with (
        pytest.warns(DeprecationWarning, match="function"),
        pytest.raises(TypeError, match="each once"),
    ):
        md.function(problem, ["crank.angle"], inputs=["crank.angle"], outputs=path)  # type: ignore[arg-type]
    for name, (new, _) in md._RENAMED.items():
        with pytest.warns(DeprecationWarning, match=new):
            assert inspect.signature(getattr(md, name)) == inspect.signature(getattr(md, new))
        assert name not in dir(md)
