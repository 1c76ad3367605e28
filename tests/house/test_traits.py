"""Joints are told by their traits and coordinates by their kinds, not by names."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from mechdae.describe.coordinate_kinds import KINDS
from mechdae.describe.kinds import JOINTS
from tests.shared.paths import ROOT

PACKAGE = ROOT / "mechdae"
NUMERIC = (
    "kernels motion/setup motion/assembly motion/continuation motion/kinematics motion/measures "
    "forces dynamics design/synthesis"
)
FILES = sorted(PACKAGE.rglob("*.py"))
CLASSES = {joint.__name__ for joint in JOINTS.values()}
NOT_JOINTS = ("self", "group", "g", "task", "load", "result")


def strings(node: ast.AST) -> set[str]:
    return {n.value for n in ast.walk(node) if isinstance(n, ast.Constant) and type(n.value) is str}


@cache
def nodes(path: Path) -> list[ast.AST]:
    """Return what a module compares and calls."""
    tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in tree if isinstance(node, ast.Compare | ast.Call)]


def compared(path: Path) -> list[ast.Compare]:
    return [node for node in nodes(path) if isinstance(node, ast.Compare)]


def told_apart(path: Path) -> list[str]:
    """Return where a module tells kinds of joints apart."""
    found = []
    for node in compared(path):
        sides = [node.left, *node.comparators]
        for side in sides:
            if not isinstance(side, ast.Attribute) or side.attr != "kind":
                continue
            whose = ast.unparse(side.value)
            listed = "joint" in whose and any(isinstance(op, ast.In | ast.NotIn) for op in node.ops)
            if listed or (whose not in NOT_JOINTS and strings(node) & JOINTS.keys()):
                found.append(f"{node.lineno}: {ast.unparse(node)}")
    for call in nodes(path):
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "isinstance":
            kinds = {n.id for n in ast.walk(call.args[1]) if isinstance(n, ast.Name)}
            if kinds & CLASSES:
                found.append(f"{call.lineno}: {ast.unparse(call)}")
    return found


def test_joints_are_told_by_their_traits() -> None:
    assert not {path: found for path in FILES if (found := told_apart(path))}


def test_coordinates_are_told_by_their_kinds() -> None:
    found = [
        f"{path.relative_to(PACKAGE)}:{node.lineno}: {ast.unparse(node)}"
        for room in NUMERIC.split()
        for path in sorted((PACKAGE / room).rglob("*.py"))
        for node in compared(path)
        if not isinstance(node.left, ast.Constant)  # a key of a table
        if {"angle", "s"} & strings(node) or strings(node) >= {"x", "y"}
    ]
    assert found == []


def test_every_coordinate_of_a_joint_has_a_kind() -> None:
    for joint in JOINTS.values():
        assert set(joint.coordinates) <= KINDS.keys(), joint.kind
        assert joint.lower == bool(joint.letter), joint.kind
