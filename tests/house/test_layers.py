"""Imports point one way only, and light commands stay light."""

from __future__ import annotations

import ast
import graphlib
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import mechdae
from tests.shared.modules import PACKAGE, imports, module_of, parsed
from tests.shared.paths import ROOT

ROOMS = {
    "errors": "",
    "docstrings": "",
    "records": "errors docstrings",
    "types": "",
    "additions": "",
    "numerics": "",
    "numerics.arms": "errors",
    "numerics.homotopy": "errors",
    "describe": "errors",
    "equations": "describe errors numerics",
    "results": "describe errors",
    "results.tables": "results errors",
    "draw.formulas": "",
    "draw": "describe draw.formulas errors results types",
    "kernels": "describe equations errors",
    "motion.setup": "describe equations errors kernels results",
    "motion.modules": "errors numerics",
    "motion.assembly": "describe equations errors kernels motion.modules motion.setup numerics "
    "numerics.homotopy results",
    "motion.continuation": "equations errors kernels motion.assembly motion.setup numerics",
    "motion.measures": "describe equations errors motion.continuation motion.setup numerics",
    "motion.kinematics": "describe equations errors kernels motion.assembly motion.continuation "
    "motion.measures motion.setup numerics results",
    "motion.cases": "describe equations errors kernels motion.assembly motion.continuation "
    "motion.kinematics motion.measures motion.setup numerics numerics.arms numerics.homotopy "
    "results",
    "forces": "describe equations errors kernels motion.assembly motion.continuation "
    "motion.kinematics motion.measures motion.setup numerics results types",
    "dynamics": "describe equations errors forces kernels motion.assembly motion.kinematics "
    "motion.setup numerics results",
    "forces.teeth": "describe equations errors kernels numerics",
    "forces.one_sided": "describe dynamics equations forces kernels motion.assembly "
    "motion.continuation motion.kinematics numerics results",
    "dynamics.contacts": "describe dynamics equations errors results",
    "forces.wear": "describe equations forces kernels numerics results",
    "tasks.dispatch": "describe dynamics errors forces motion.kinematics results",
    "design.jobs": "describe errors records",
    "design.derivatives": "describe equations errors forces kernels motion.continuation "
    "motion.kinematics motion.setup numerics results",
    "design.studies": "describe design.derivatives design.jobs dynamics equations errors forces "
    "kernels motion.assembly motion.continuation motion.kinematics motion.measures motion.setup "
    "numerics results tasks.dispatch",
    "design.synthesis": "describe design.derivatives design.jobs design.studies equations "
    "errors forces kernels motion.kinematics motion.measures motion.setup numerics "
    "numerics.homotopy results tasks.dispatch",
    "tasks.export": "describe errors results",
    "tasks": "describe design.derivatives design.jobs design.studies design.synthesis dynamics "
    "equations errors forces kernels motion.assembly motion.kinematics motion.modules motion.setup "
    "numerics results results.tables tasks.dispatch",
    "cli": "describe design.jobs design.synthesis draw errors kernels motion.assembly "
    "motion.cases motion.modules results results.tables tasks tasks.dispatch tasks.export",
    "parts.types": "cli describe design.jobs design.synthesis draw errors numerics results "
    "results.tables tasks.dispatch tasks",
    "parts.page": "cli describe draw equations errors forces kernels motion.continuation "
    "motion.kinematics motion.measures motion.setup results tasks",
    "parts.exchange": "cli describe draw equations errors kernels motion.continuation "
    "motion.kinematics numerics numerics.arms results tasks tasks.export types",
    "parts.models": "describe draw equations errors motion.assembly motion.kinematics motion.setup "
    "results tasks types",
    "parts.paper": "cli describe draw draw.formulas errors results tasks tasks.export types",
    "parts.proof": "cli describe equations errors kernels motion.cases motion.continuation "
    "motion.kinematics motion.setup results",
    "parts.play": "describe draw equations errors forces kernels motion.kinematics results "
    "results.tables",
    "parts.bench": "cli describe design.jobs design.synthesis draw dynamics errors kernels "
    "motion.kinematics motion.setup tasks",
}
"""Each room, and the rooms before it of which it may import; `FREE` aside."""
FREE = ("records", "types", "additions")
"""What every room may import."""
MOST = 20
"""Modules in one folder."""
LONGEST = 80
"""Lines of a function, its docstring aside."""


def room(module: str) -> str:
    """Return the innermost room that a module is in."""
    name = module.removeprefix("mechdae").strip(".")
    while name and name not in ROOMS:
        name = name.rpartition(".")[0]
    return name


FILES = [p for p in sorted(PACKAGE.rglob("*.py")) if p.parent != PACKAGE or p.stem[0] != "_"]


def test_imports_point_to_the_left() -> None:
    wrong = set()
    for path in FILES:
        here = room(module_of(path))
        for name in imports(path):
            there = room(name) if name.startswith("mechdae.") else ""
            if there and there not in (here, *FREE, *ROOMS[here].split()):
                wrong.add(f"{path.relative_to(PACKAGE)} of {here} imports {there}: see ROOMS")
    assert not wrong


def test_rooms_are_in_order() -> None:
    known: set[str] = set()
    for name, before in ROOMS.items():
        assert set(before.split()) <= known, name
        known.add(name)


def test_map_of_the_package_is_the_one_that_is_checked() -> None:
    text = (ROOT / "docs/theory/house.md").read_text(encoding="utf-8")
    drawn = re.findall(r"^\| `([\w.]+)` \|", text.split("## Map of the package")[1], re.M)
    assert drawn == list(ROOMS), "rows of the map in docs/theory/house.md and ROOMS differ"
    inside = {path.stem for path in PACKAGE.iterdir() if path.suffix == ".py" or is_room(path)}
    boxes = {name.partition(".")[0] for name in drawn}
    assert boxes == {name for name in inside if not name.startswith("_")}
    for path in FILES:  # folders of rooms hold nothing else
        inner = module_of(path.parent / "x").rpartition(".")[0]
        rooms = [name for name in ROOMS if f"mechdae.{name}".startswith(f"{inner}.")]
        assert path.stem == "__init__" or room(module_of(path)), f"{path} beside {rooms}"


def test_no_room_names_a_part() -> None:
    """In strings neither, whatever they hold: parts add themselves."""
    for path in FILES:
        here = room(module_of(path))
        part = ".".join(here.split(".")[:2])
        text = path.read_text(encoding="utf-8")
        named = {f"parts.{own}" for own in re.findall(r"mechdae[./]parts[./](\w+)", text)}
        assert named <= {part}, path


def test_the_table_of_questions_is_what_is_asked() -> None:
    """Every question that plain code asks cases, or that a case answers, and where it is asked."""
    text = (ROOT / "docs/theory/house.md").read_text(encoding="utf-8")
    table = text.split("### A case")[1].split("\n## ")[0]
    rows = re.findall(r"^\| ([a-z, ]+) \| `([\w/]+\.py)` \|", table, re.M)
    listed = {question: file for names, file in rows for question in names.split(", ")}
    for question, file in listed.items():
        assert f'"{question}"' in (PACKAGE / file).read_text(encoding="utf-8"), (question, file)
    questions = {
        question
        for path in FILES
        for question in re.findall(r'cases\(\s*"([^"]+)"', path.read_text(encoding="utf-8"))
    }
    answered = {q for case in mechdae.CASES for q in import_module(f"{case}.adds").ADDS}
    assert questions <= set(listed), f"docs/theory/house.md lacks rows of {questions - set(listed)}"
    assert answered == set(listed), f"asked or answered alone: {answered ^ set(listed)}"


def test_words_of_the_glossary_have_one_meaning() -> None:
    text = (ROOT / "docs/theory/house.md").read_text(encoding="utf-8")
    table = text.split("## Words")[1].split("\n## ")[0]
    words = re.findall(r"^\| ([a-z][a-z ,]*) \| \S", table, re.M)
    single = [word for entry in words[1:] for word in entry.split(", ")]
    assert len(single) > 30
    assert single == sorted(single)
    assert len(set(single)) == len(single)


def is_room(path: Path) -> bool:
    return path.is_dir() and (path / "__init__.py").exists()


def test_functions_are_short() -> None:
    for path in FILES:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.FunctionDef) and node.end_lineno:
                said = (ast.get_docstring(node) or "").count("\n") + 1
                assert node.end_lineno - node.lineno - said < LONGEST, f"{path}: {node.name}"


def test_folders_are_small() -> None:
    for folder in {path.parent for path in FILES}:
        modules = [path for path in folder.glob("*.py") if path.stem != "__init__"]
        assert len(modules) <= MOST, folder


def test_a_class_name_means_one_thing() -> None:
    homes: dict[str, list[str]] = {}
    for path in FILES:
        for node in parsed(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(module_of(path))
    several = {name: found for name, found in homes.items() if len(found) > 1}
    assert not several, several


def test_no_circles() -> None:
    """Imports at run time, inside of functions too, and those for type checkers."""
    modules = {module_of(path): path for path in FILES if path.stem != "__init__"}
    arrows = {
        name: imports(path, strings=False, typed=True) & modules.keys() - {name}
        for name, path in modules.items()
    }
    order = graphlib.TopologicalSorter(arrows)
    order.prepare()


def test_the_description_knows_no_numerics() -> None:
    for path in (PACKAGE / "describe").rglob("*.py"):
        used = {name.split(".")[0] for name in imports(path)}
        assert not used & {"casadi", "numpy", "matplotlib"}, path.name


def test_only_drawing_knows_matplotlib() -> None:
    for path in FILES:
        if "matplotlib" in {name.split(".")[0] for name in imports(path)}:
            assert module_of(path).split(".")[1] == "draw" or ".drawn." in module_of(path), path


def modules_of(code: str) -> set[str]:
    script = f"{code}\nimport sys; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return set(done.stdout.splitlines()[-1].split())


def loaded(code: str) -> set[str]:
    return {name.split(".")[0] for name in modules_of(code)}


@pytest.mark.parametrize(
    "code",
    ["import mechdae", "from mechdae.cli import main; main(['list', '--json'])"],
    ids=["import", "list"],
)
def test_light_commands_load_no_numerics(code: str) -> None:
    assert not loaded(code) & {"casadi", "matplotlib", "numpy", "dataclasses", "inspect"}


def test_solving_loads_no_drawing() -> None:
    code = "import mechdae as md; md.solve('slider-crank', 'modes')"
    assert "matplotlib" not in loaded(code)


RARE = {
    "mechdae.motion.cases.larger_groups.linkage_group", "mechdae.motion.assembly.multistart",
    "mechdae.motion.assembly.vector_loops", "mechdae.describe.vectors.expand",
    "mechdae.tasks.export",
    "mechdae.motion.cases.curves.curve_corners", "mechdae.motion.measures.along_sweep",
    "mechdae.equations.tree.tree_model", "mechdae.design.studies", "csv", "difflib", "html",
}  # fmt: skip
"""What a plain sweep on the command line does without: each is a part of its start."""


def test_a_plain_sweep_loads_what_it_needs() -> None:
    words = ["solve", "four-bar-crank-rocker", "--task", "turn", "--poses", "9"]
    found = modules_of(f"from mechdae.cli import main; main({words})")
    assert not found & RARE
    assert len([name for name in found if name.startswith("mechdae")]) < 185
