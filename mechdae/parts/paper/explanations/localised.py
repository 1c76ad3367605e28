"""What all papers share: the pose they are about, their language, how they are written to files."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from mechdae.describe import whole_file
from mechdae.describe.units import SI, Units
from mechdae.draw.diagram.scene import choose_pose, read_scene
from mechdae.draw.formulas.tree import (
    Column,
    Document,
    Number,
    UnitName,
    Wording,
    decimals,
    rounded,
)
from mechdae.draw.formulas.writers import as_html, as_typst
from mechdae.draw.words import unit_in_russian
from mechdae.errors import InputError
from mechdae.parts.paper.explanations.subject import KINDS, Subject
from mechdae.parts.paper.phrases import Phrases
from mechdae.records import dataclass
from mechdae.results import Result

NUMBER = re.compile(r"(?<![\w.])(\d+)\.(\d+)(?=(e[-+]?\d+)?(?![\w.]))")
"""A number with decimals that stands by itself."""


def subject_of(result: Any, pose: int | None, say: Phrases) -> Subject:
    if result.kind not in KINDS:
        raise InputError(
            f"a task of kind {result.kind} is not explained",
            hint="a sweep, or a task of kind reactions",
        )
    if result.mechanism.dimension == 3:
        from mechdae.parts.paper.explanations.space.spatial_group import seen_in_space

        make, scene, index = seen_in_space(result, pose)
    else:
        make, scene = Subject, read_scene(result)
        index = choose_pose(scene, result.kind, pose)
    good = [k for k in scene.assembled() if scene.status[k] != "jammed"]
    if index not in good:
        near = min(good, key=lambda k: abs(k - index), default=None)
        if near is not None and pose is None:
            return make(result, scene, near, say)
        raise InputError(
            f"pose {index} is {scene.status[index]}: there is nothing to explain",
            hint=f"pose {near} is {scene.status[near]}" if near is not None else "",
        )
    return make(result, scene, index, say)


def in_lengths(result: Result, units: str | Units = SI) -> Result:
    """Return a result in units, with lengths in metres where they are in none: pictures too."""
    found = result.in_units(units) if units else result
    return found if "m" in found.units.by_si else found.in_units((*found.units.asked, "m"))


@dataclass(frozen=True)
class Paper:
    """A document."""

    document: Document

    def html(self) -> str:
        """Return it as one HTML file with its pictures in it, without scripts or requests."""
        return as_html(self.document)

    def typ(self) -> str:
        """Return it in the markup of Typst, with its pictures in it."""
        return as_typst(self.document)

    def _written(self, target: Path, form: str) -> Path:
        """Write it in one of its forms, whole or not at all, and return where it is."""
        content: str | bytes = getattr(self, form)()
        with whole_file(target) as file:
            file.write(content.encode() if isinstance(content, str) else content)
        return target

    def _repr_html_(self) -> str:
        return as_html(self.document, alone=False)


def localised(document: Document, units: Units = SI) -> Document:
    """Return a document in the units it is to be shown in, with those and signs of its language.

    Angles stay in degrees, their rates in rad/s: in these the formulas hold.
    """
    linear = {si: shown for si, shown in units.by_si.items() if not si.startswith("rad")}
    if linear:
        units = Units(units.asked, linear)
        document = _changed(document, lambda node: _in_units(node, units))
    return _changed(document, _in_russian) if document.lang == "ru" else document


def _in_units(node: object, units: Units) -> object:
    if isinstance(node, Number | Column):
        return converted(node, units)
    return UnitName(named(node.text, units)) if isinstance(node, UnitName) else node


def converted(node: Number | Column, units: Units) -> Number | Column:
    """Return a number or a column in the unit that it is shown in."""
    exact = node.exact
    shown = units.of(exact.unit.replace("²", "2")) if exact is not None else None
    if exact is None or shown is None or shown.factor == 1:
        return node
    places, power = decimals(
        *(value * shown.factor for value in exact.alike), significant=exact.significant
    )
    digits = tuple(rounded(value * shown.factor, places, power) for value in exact.values)
    unit = named(node.unit, units) if node.unit else ""
    if isinstance(node, Number):
        return replace(node, digits=digits[0], power=power, unit=unit)
    return replace(node, digits=digits, power=power, unit=unit)


def named(unit: str, units: Units) -> str:
    """Return the name of the unit that one in SI is shown in: ``m/s²`` as ``mm/s²``."""
    name = units.of(unit.replace("²", "2")).name
    return name.replace("2", "²") if "²" in unit else name


def _in_russian(node: object) -> object:
    if isinstance(node, Number):
        return replace(node, digits=_comma(node.digits), unit=unit_in_russian(node.unit))
    if isinstance(node, Column):
        digits = tuple(map(_comma, node.digits))
        return replace(node, digits=digits, unit=unit_in_russian(node.unit))
    if isinstance(node, str):
        return _comma(node)
    return Wording(_comma(unit_in_russian(node.text))) if isinstance(node, Wording) else node


def _changed(node: object, change: Callable[[object], object]) -> Any:
    """Return a part of a document with what is in it changed."""
    if isinstance(node, tuple):
        return tuple(_changed(inner, change) for inner in node)
    if isinstance(node, str | Number | Column | Wording):
        return change(node)
    if not is_dataclass(node) or isinstance(node, type):
        return node
    found = {entry.name: getattr(node, entry.name) for entry in fields(node)}
    changed = {
        name: _changed(value, change)
        for name, value in found.items()
        if isinstance(value, tuple) or is_dataclass(value)
    }
    return replace(node, **changed)


def _comma(text: str) -> str:
    """Return a number with a decimal comma; other texts, names such as A.B among them, stay."""
    return NUMBER.sub(r"\1,\2", text)
