"""Docstrings of what users call: complete, current, and with examples that run."""

from __future__ import annotations

import dataclasses
import doctest
import inspect
import pydoc
import re
from collections.abc import Iterator
from typing import Any

import pytest

import mechdae as md
from mechdae.describe.field_docs import USUAL
from mechdae.describe.file.schema import schema
from mechdae.describe.values import Value

NAMES = [name for name in md.__all__ if name != "__version__"]
CALLED = (
    "Solver", "Problem", "DrawnMechanism", "Page", "Exported",
    *(name for name in NAMES if name.endswith("Result")),
)  # fmt: skip
"""Classes whose methods users call."""
RARE = {
    "InconsistentStartError", "IndeterminateFrictionError", "InfeasibleMotionError",
    "SingularMassError",
}  # fmt: skip
"""Errors that no short example meets."""
NEEDS = {"certify": "flint", "check_certificate": "flint"}
SECTION = re.compile(r"^(\w+)\n-{3,}\n(.*?)(?=^\w+\n-{3,}\n|\Z)", re.M | re.S)
FLAGS = doctest.NORMALIZE_WHITESPACE


def sections(thing: object) -> dict[str, str]:
    return dict(SECTION.findall(inspect.getdoc(thing) or ""))


def named(text: str) -> list[str]:
    """Return the names that a section of parameters or attributes describes, in their order."""
    heads = re.findall(r"^(\*{0,2}\w[^:\n]*)", text, re.M)
    return [word.strip().lstrip("*") for head in heads for word in head.split(",")]


def taken(thing: Any) -> list[str]:
    """Return what a call takes, but for what is private."""
    given = [name for name in inspect.signature(thing).parameters if name[0] != "_"]
    return [name for name in given if name not in ("self", "from_file", "unmade")]


def failing(name: str) -> list[str]:
    """Return what the docstring of a public name lacks."""
    thing, found = getattr(md, name), sections(getattr(md, name))
    first = (inspect.getdoc(thing) or "").split("\n")[0]
    lacks = [] if first.endswith((".", ":")) else [f"a first line that is a sentence: {first}"]
    error = inspect.isclass(thing) and issubclass(thing, Exception)
    if ">>> " not in found.get("Examples", "") and name not in RARE:
        lacks.append("an example")
    if inspect.isclass(thing):
        if not error and not {"Parameters", "Attributes"} & found.keys():
            lacks.append("Parameters or Attributes")
    elif not {"Returns", "Yields"} & found.keys():
        lacks.append("Returns")
    if "Parameters" in found or not inspect.isclass(thing):
        described, takes = named(found.get("Parameters", "")), taken(thing)
        if set(described) != set(takes):
            lacks.append(f"parameters {set(described) ^ set(takes)}, described or taken alone")
    return [f"{name} lacks {what}" for what in lacks]


def test_public_names_say_what_they_take_and_return() -> None:
    assert not [line for name in NAMES for line in failing(name)]


def methods(name: str) -> Iterator[tuple[str, Any]]:
    """Yield the methods of a class that users see."""
    cls = getattr(md, name)
    shown = dir(object.__new__(cls)) if hasattr(cls, "shows") else dir(cls)
    for word in shown:
        held = inspect.getattr_static(cls, word, None)
        if word[0] != "_" and inspect.isfunction(held):
            yield f"{name}.{word}", held


def test_methods_say_what_they_take() -> None:
    found = dict(pair for name in CALLED for pair in methods(name))
    assert len(found) > 40
    for name, method in found.items():
        text = inspect.getdoc(method) or ""
        assert text.split("\n")[0].endswith("."), name
        missing = [word for word in taken(method) if not re.search(rf"\b{word}\b", text)]
        assert not missing, (name, missing)


def examples(name: str) -> Iterator[doctest.DocTest]:
    """Yield the examples of a public name and of its methods."""
    thing = getattr(md, name)
    own = [(name, thing), *(methods(name) if name in CALLED else ())]
    for called, held in own:
        text = inspect.getdoc(held) or ""
        yield doctest.DocTestParser().get_doctest(text, {"md": md}, called, None, 0)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in RARE])
def test_examples_run(name: str) -> None:
    import matplotlib.pyplot as plt

    if name in NEEDS:
        pytest.importorskip(NEEDS[name], reason="extra of certificates, not on every machine")
    said: list[str] = []
    for test in examples(name):
        doctest.DocTestRunner(optionflags=FLAGS).run(test, out=said.append)
    plt.close("all")
    assert not said, "".join(said)


def test_a_wrong_example_is_seen() -> None:
    wrong = inspect.getdoc(md.judged).replace("0.648", "0.649")  # type: ignore[union-attr]
    test = doctest.DocTestParser().get_doctest(wrong, {"md": md}, "judged", None, 0)
    result = doctest.DocTestRunner(optionflags=FLAGS).run(test, out=lambda text: None)
    assert result.failed == 1


# -- what help shows -----------------------------------------------------------------------------


def test_help_shows_functions_as_they_are_called() -> None:
    text = pydoc.render_doc(md.four_bar, renderer=pydoc.plaintext)
    assert "four_bar(ground: 'float', crank: 'float', coupler: 'float'" in text
    assert "function four_bar in module" in text
    for name in NAMES:
        thing = getattr(md, name)
        assert thing.__name__ == name, name  # under its name, also where it answers slips


@pytest.mark.parametrize("used", [False, True])
def test_help_shows_descriptions_with_their_fields(used: bool) -> None:
    if used:  # its first instance has the constructor compiled
        md.Spring("s", coordinate="guide.slide")
    text = pydoc.render_doc(md.Spring, renderer=pydoc.plaintext)
    assert "Spring(name: 'str', between:" in text
    assert "__init__(self, name: 'str', between:" in text
    assert not re.search(r"first_init|_more|= equal\(|= put\(", text)
    stiffness = [line.strip(" |") for line in text.splitlines()]
    place = stiffness.index("stiffness : float or expression, default 0.0")
    assert stiffness[place + 1].endswith("[N/m or N m/rad].")
    assert md.Spring("s", coordinate="guide.slide").stiffness == 0.0  # help changes nothing else
    with pytest.raises(md.UnknownName, match="stifness"):
        md.Spring("s", coordinate="guide.slide", stifness=1.0)  # type: ignore[call-arg]


def described(cls: type[Value]) -> Iterator[type[Value]]:
    """Yield the descriptions of a file, with those that parts add."""
    schema()
    for kind in cls.__subclasses__():
        yield kind
        yield from described(kind)


def test_fields_say_what_they_hold() -> None:
    """With their unit once: the schema, the page of keys and docstrings write it behind."""
    for name in NAMES:
        getattr(md, name)
    count = 0
    for cls in described(Value):
        for entry in dataclasses.fields(cls):
            if "kind" not in entry.metadata or cls.__module__.split(".")[0] != "mechdae":
                continue
            words, unit = entry.metadata["doc"] or USUAL.get(entry.name), entry.metadata["unit"]
            assert words, (cls, entry.name)
            twice = rf"(?<![\w/]){unit}(?![\w/])" if unit and unit != "1" else r"(?!)"
            assert not re.search(twice, words), (cls, entry.name, words)
            count += 1
    assert count > 400


def test_docstrings_follow_from_fields() -> None:
    """Each field of a description is there once, by what the JSON Schema says of it too."""
    for name in NAMES:
        cls = getattr(md, name)
        if inspect.isclass(cls) and hasattr(cls, "documented"):
            described = named(sections(cls)["Parameters"])
            assert described == taken(cls), name
            assert "Parameters\n---" not in vars(cls)["__doc__"].text, name
