"""Imports point one way only, and light commands stay light."""

from __future__ import annotations

import ast
import graphlib
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.shared.paths import ROOT

PACKAGE = ROOT / "mechdae"
ROOMS = {
    "errors": "",
    "records": "",
    "describe": "errors",
    "numerics": "",
    "modules": "errors numerics",
    "homotopy": "errors",
    "model": "describe errors numerics",
    "kernels": "describe errors model",
    "types": "",
    "results": "describe errors types",
    "export": "describe errors results",
    "tables": "results",
    "composition": "describe errors",
    "formulas": "",
    "draw": "composition describe errors formulas results",
    "jobs": "errors",
    "setup": "describe errors kernels model results types",
    "assembly": "describe errors homotopy kernels model modules numerics results setup types",
    "continuation": "assembly errors kernels numerics setup",
    "measures": "continuation describe errors model numerics setup",
    "kinematics": "assembly continuation describe errors kernels measures model results setup "
    "types",
    "forces": "assembly continuation describe errors kernels kinematics measures model numerics "
    "results setup",
    "dynamics": "assembly describe errors forces kernels kinematics model numerics results setup "
    "types",
    "derivatives": "continuation describe errors forces kernels kinematics model numerics results "
    "setup",
    "solver": "describe dynamics errors forces kinematics results",
    "studies": "assembly continuation derivatives describe dynamics errors forces jobs kernels "
    "kinematics measures model numerics results setup solver",
    "synthesis": "derivatives describe errors forces homotopy jobs kernels kinematics measures "
    "model numerics results setup solver studies",
    "schemes": "composition describe errors jobs numerics results solver synthesis",
    "tasks": "assembly derivatives describe dynamics errors forces kernels kinematics model "
    "modules numerics results schemes setup solver studies synthesis",
    "ranking": "composition describe errors numerics results tasks",
    "pages": "continuation describe draw errors forces kernels kinematics model results setup "
    "tasks",
    "exchange": "continuation describe draw errors export kernels kinematics model pages results "
    "tasks",
    "explanations": "describe draw errors export formulas results tasks",
    "reports": "describe draw errors explanations export formulas results tasks",
    "assignments": "describe draw errors explanations formulas reports results tasks",
    "certificates": "assembly continuation describe errors kernels kinematics model results setup",
    "bench": "describe dynamics errors kernels kinematics setup synthesis tasks",
    "cli": "assembly assignments bench certificates composition describe draw errors exchange "
    "explanations export jobs kernels modules pages ranking reports results synthesis tables tasks",
}
"""Each room, and the rooms before it of which it may import, `records` aside."""
MOST = 20
"""Modules in one folder."""
LONGEST = 80
"""Lines of a function."""


def room(module: str) -> str:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def for_type_checkers(tree: ast.Module) -> set[ast.AST]:
    return {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports(path: Path, strings: bool = True, typed: bool = False) -> set[str]:
    """Return what a module imports, and the modules it names in strings to import them later."""
    found = set()
    tree = parsed(path)
    unused = set() if typed else for_type_checkers(tree)
    for node in ast.walk(tree):
        if node in unused:
            continue
        if strings and isinstance(node, ast.Constant) and isinstance(node.value, str):
            found |= set(re.findall(r"^(mechdae(?:\.\w+)+)(?::\w+)?$", node.value))
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found


def module_of(path: Path) -> str:
    return ".".join(("mechdae", *path.relative_to(PACKAGE).with_suffix("").parts))


FILES = [p for p in sorted(PACKAGE.rglob("*.py")) if p.parent != PACKAGE or p.stem[0] != "_"]


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_point_to_the_left(path: Path) -> None:
    here = room(module_of(path))
    for name in imports(path):
        if name.startswith("mechdae."):
            there = room(name)
            if there.startswith("__"):
                continue
            assert there in (here, "records", *ROOMS[here].split()), f"{here} imports {there}"


def test_rooms_are_in_order() -> None:
    known: set[str] = set()
    for name, before in ROOMS.items():
        assert set(before.split()) <= known, name
        known.add(name)


def test_map_of_the_package_is_the_one_that_is_checked() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    drawn = re.findall(r"^\| `(\w+)` \|", text.split("## Map of the package")[1], re.M)
    assert drawn == list(ROOMS)
    inside = {path.stem for path in PACKAGE.iterdir() if path.suffix == ".py" or is_room(path)}
    assert set(drawn) == {name for name in inside if not name.startswith("_")}


def is_room(path: Path) -> bool:
    return path.is_dir() and (path / "__init__.py").exists()


def test_functions_are_short() -> None:
    for path in FILES:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.FunctionDef) and node.end_lineno:
                assert node.end_lineno - node.lineno < LONGEST, f"{path}: {node.name}"


def test_folders_are_small() -> None:
    for folder in {path.parent for path in FILES}:
        modules = [path for path in folder.glob("*.py") if path.stem != "__init__"]
        assert len(modules) <= MOST, folder


def test_a_class_name_means_one_thing() -> None:
    """Checkers of certificates are programs by themselves: what they share is one text."""
    homes: dict[str, list[str]] = {}
    for path in FILES:
        if module_of(path).startswith("mechdae.certificates.check_"):
            continue
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
            assert room(module_of(path)) == "draw", path


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
    assert not loaded(code) & {"casadi", "matplotlib", "numpy"}


def test_solving_loads_no_drawing() -> None:
    code = "import mechdae as md; md.solve('slider-crank', 'modes')"
    assert "matplotlib" not in loaded(code)


RARE = {
    "mechdae.assembly.linkage.linkage_group", "mechdae.assembly.multistart",
    "mechdae.assembly.vector_loops", "mechdae.describe.vectors.expand", "mechdae.export",
    "mechdae.kinematics.curve_corners", "mechdae.measures.along_sweep",
    "mechdae.model.tree.tree_model", "mechdae.studies", "csv", "difflib", "html",
}  # fmt: skip
"""What a plain sweep on the command line does without: each is a part of its start."""


def test_a_plain_sweep_loads_what_it_needs() -> None:
    words = ["solve", "four-bar-crank-rocker", "--task", "turn", "--poses", "9"]
    found = modules_of(f"from mechdae.cli import main; main({words})")
    assert not found & RARE
    assert len([name for name in found if name.startswith("mechdae")]) < 185
