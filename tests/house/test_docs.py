"""What the documentation shows is what the package does."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import json
import re
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import COMMANDS, main
from mechdae.describe.file import library
from mechdae.tasks.check import check
from tests.scripts import all_modes, counts_of_modes
from tests.scripts.solver_bars import written
from tests.shared.c_kernels import needs_gcc
from tests.shared.paths import HISTORY, ROOT, document_pages

PAGES = [*sorted(ROOT.glob("*.md")), *document_pages()]
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def fences(page: str, language: str) -> list[str]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.S | re.M)


def problems() -> list[tuple[str, str]]:
    pages = [str(page.relative_to(ROOT)) for page in PAGES if page.name != "for-programs.md"]
    found = [(page, text) for page in pages for text in fences(page, "toml")]
    found = [(page, text) for page, text in found if text.startswith("schema")]
    places = {"README.md", "docs/reference/problem-file.md", "docs/reference/vector-loops.md"}
    assert places <= {page for page, _ in found}
    return found


def same(shown: str, ours: str) -> bool:
    """Return whether two lines agree: words as they are, numbers to the digits that count."""
    if NUMBER.sub("#", " ".join(shown.split())) != NUMBER.sub("#", " ".join(ours.split())):
        return False
    if "error <=" in shown:
        return True
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(ours), strict=True)
    return all(float(a) == pytest.approx(float(b), rel=1e-9, abs=1e-12) for a, b in pairs)


def agree(shown: list[str], ours: list[str]) -> bool:
    """Return whether the lines are those shown, where ``...`` stands for any lines."""
    if not shown:
        return not ours
    if shown[0] == "...":
        return any(agree(shown[1:], ours[k:]) for k in range(len(ours) + 1))
    return bool(ours) and same(shown[0], ours[0]) and agree(shown[1:], ours[1:])


def test_agreement_of_lines() -> None:
    assert agree(["a 1.0", "...", "c"], ["a  1.00", "b", "b", "c"])
    assert agree(["..."], [])
    assert not agree(["a 1.0"], ["a 1.1"])
    assert not agree(["a", "..."], ["b"])
    assert not agree(["a"], ["a", "b"])


# -- problem files ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("page", "block"), problems(), ids=lambda text: text[:20].split("\n")[0])
def test_problem_files_shown_solve(page: str, block: str, tmp_path: Path) -> None:
    path = tmp_path / "shown.toml"
    path.write_text(block, encoding="utf-8")
    problem = md.load(path)
    assert problem.tasks
    for name, task in problem.tasks.items():
        if task.kind == "composition":  # a search that is as long as it is wanted
            task = replace(task, samples=300, starts=4, grow=0, keep=3)
        result = md.solve(problem, task)
        assert result.fault is None, f"{page} {name}"
        assert set(result.status) == {"ok"}
    assert all(verdict.met for verdict in check(problem))


def test_table_of_a_load_shown_is_read(tmp_path: Path) -> None:
    page = "docs/reference/problem-file.md"
    example = next(block for block in fences(page, "toml") if block.startswith("schema"))
    (load,) = (block for block in fences(page, "toml") if "gas.csv" in block)
    (table,) = fences(page, "csv")
    (tmp_path / "gas.csv").write_text(table, encoding="utf-8")
    (tmp_path / "engine.toml").write_text(example + load, encoding="utf-8")
    result = md.solve(md.load(tmp_path / "engine.toml"), "forces")
    assert result.fault is None
    slides = result.joints["guide"].slide_velocity
    half = int(np.argmin(np.abs(result.drivers["crank.angle"].position - np.pi / 6)))
    force = -20e-4 * (2.0e5 + 1.2e5) / 2
    speed = result.drivers["crank.angle"].velocity[0]
    assert result.efforts["crank.angle"][half] * speed == pytest.approx(
        -force * slides[half], rel=1e-12
    )


def lacking(page: str, names: Iterable[str]) -> list[str]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return [f"{page} has no row of `{name}`" for name in names if f"`{name}`" not in text]


def test_every_kind_is_documented() -> None:
    from mechdae.describe.kinds import JOINTS, LOADS
    from mechdae.describe.tasks.kinds import MEASURES, TASKS
    from mechdae.draw.catalogue import PICTURES

    lacks = lacking("docs/reference/problem-file.md", LOADS)
    lacks += lacking("docs/reference/tasks.md", TASKS)
    lacks += lacking("docs/reference/joints.md", JOINTS) + lacking(
        "docs/reference/measures.md", MEASURES
    )
    lacks += lacking("docs/reference/pictures.md", PICTURES)
    assert not lacks


# -- command line ----------------------------------------------------------------------------------


def consoles() -> list[tuple[str, str]]:
    pages = [str(page.relative_to(ROOT)) for page in PAGES]
    return [(page, block) for page in pages for block in fences(page, "console")]


@pytest.mark.parametrize(
    ("page", "block"), consoles(), ids=lambda text: text.split("\n")[0].removeprefix("$ mechdae ")
)
def test_commands_shown_print_what_is_shown(page, block, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    examples = [text for of, text in problems() if of == "docs/reference/problem-file.md"]
    slip = examples[0].replace('"prismatic"', '"prismatc"')
    (tmp_path / "mine.toml").write_text(slip if page != "README.md" else fences(page, "toml")[0])
    (lift,) = (text for text in examples if "b{k-1}.Q" in text)
    (tmp_path / "lift.toml").write_text(lift.replace("b{k-1}.Q", "b{k-1}.R"))
    code = None
    for entry in re.split(r"^\$ ", block, flags=re.M)[1:]:
        command, *shown = entry.rstrip("\n").split("\n")
        words = command.split()
        if words[0] == "mechdae":
            code = main(words[1:])
            captured = capsys.readouterr()
            text = (captured.out.rstrip("\n") + "\n" + captured.err).strip("\n")
            ours = text.split("\n") if text else []
        elif command == "echo $?":
            ours = [str(code)]
        else:
            assert words[:2] == ["head", "-c"], f"{page}: {command}"
            start = Path(words[3]).read_text(encoding="utf-8")[: int(words[2])]
            ours = start.rstrip("\n").split("\n")
        while shown and not shown[-1]:
            shown.pop()
        assert agree(shown, ours), f"{page}: {command}\n" + "\n".join(ours[:60])


def spoken() -> list[tuple[str, str]]:
    """Return each command with arguments that a page names, in code spans and blocks."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for block in re.findall(r"```\w*\n(.*?)```", text, re.S):
            found += [(page.name, m) for m in re.findall(r"^\s*\$ (mechdae .*)$", block, re.M)]
        plain = re.sub(r"```\w*\n.*?```", "", text, flags=re.S)
        found += [(page.name, m) for m in re.findall(r"`(mechdae [^`]*)`", plain)]
    return found


def test_commands_and_options_named_exist(capsys) -> None:
    options = {}
    for name in COMMANDS:
        assert main([name, "--help"]) == 0
        options[name] = set(re.findall(r"--[a-z]+", capsys.readouterr().out))
    named = spoken()
    assert len(named) > 30
    for page, text in named:
        words = text.split()[1:]
        if words[0] in ("COMMAND", "--version"):
            continue
        assert words[0] in COMMANDS, f"{page}: {text}"
        used = set(re.findall(r"(?<!\S)\[?(--[a-z]+)", text))
        assert used <= options[words[0]], f"{page}: {text}"
    assert set(COMMANDS) <= {text.split()[1] for page, text in named if page == "command-line.md"}


def test_problems_named_exist() -> None:
    for page, text in spoken():
        for word in text.split("$")[0].split():
            if "-" in word.strip("-") and re.fullmatch(r"[a-z][a-z-]+", word):
                assert word in library.names() or text.split()[1] == "new", f"{page}: {text}"


# -- Python ----------------------------------------------------------------------------------------


def with_blocks() -> list[Any]:
    """Return the pages of the documentation with blocks of Python that are to run."""
    pages = [page for page in document_pages() if "\n```python\n" in page.read_text("utf-8")]
    marks = {"exchange": needs_gcc}
    return [
        pytest.param(page, id=page.stem, marks=[marks[page.stem]] if page.stem in marks else [])
        for page in pages
    ]


def test_most_blocks_of_python_run() -> None:
    assert len(with_blocks()) > 12


@pytest.mark.parametrize("page", with_blocks())
def test_python_blocks_run_and_print_what_is_shown(page, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$(?:\n\n```text\n(.*?)^```$)?", text, re.S | re.M)
    names: dict[str, object] = {}
    for code, shown in blocks:
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(code, page, "exec"), names)
        assert agree(shown.splitlines(), out.getvalue().splitlines()), out.getvalue()


def test_python_block_of_the_readme_runs() -> None:
    for code in fences("README.md", "python"):
        exec(compile(code, "README.md", "exec"), {})


def test_public_names_are_documented() -> None:
    text = (ROOT / "docs/reference/python.md").read_text(encoding="utf-8")
    described = set(re.findall(r"\b\w+\b", text))
    quiet = {"__version__"}
    lacks = sorted(set(md.__all__) - quiet - described)
    assert not lacks, f"docs/reference/python.md says nothing of these: {', '.join(lacks)}"


# -- links, map, versions --------------------------------------------------------------------------


def anchors(page: Path) -> set[str]:
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", [*PAGES, *HISTORY.glob("*.md")], ids=lambda page: page.name)
def test_relative_links_resolve(page: Path) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", link):
            continue
        place, _, anchor = link.partition("#")
        target = (page.parent / place).resolve() if place else page
        assert target.exists(), f"{page.name}: {link}"
        if anchor:
            assert anchor in anchors(target), f"{page.name}: {link}"


@pytest.mark.parametrize("page", [*PAGES, *HISTORY.glob("*.md")], ids=lambda page: page.name)
def test_headings_descend_by_one_level(page: Path) -> None:
    """The site takes warnings for errors, and this is one."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    levels = [len(marks) for marks in re.findall(r"^(#+) ", text, re.M)]
    assert levels[0] == 1
    assert all(below <= above + 1 for above, below in pairwise(levels))


def test_every_page_is_in_the_contents() -> None:
    index = (ROOT / "docs/index.md").read_text(encoding="utf-8")
    for page in document_pages():
        name = str(page.relative_to(ROOT / "docs"))
        assert name == "index.md" or f"]({name})" in index, name


def test_checks_of_the_contributors_are_those_of_ci() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    commands = (ROOT / ".ci/run").read_text(encoding="utf-8")
    for command in ("ruff check .", "ruff format --check .", "mypy", "pytest"):
        assert f"`{command}`" in text
        assert command in commands


def test_version_is_the_same_everywhere() -> None:
    assert f'\nversion: "{md.__version__}"\n' in (ROOT / "CITATION.cff").read_text()
    assert f"\n## {md.__version__}\n" in (ROOT / "CHANGELOG.md").read_text()


def test_changes_of_a_version_are_eight_lines_with_a_date() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.split(r"^## ", text, flags=re.M)[1:]
    assert len(versions) > 20
    for version in versions:
        name, _, body = version.partition("\n")
        date, *lines = [line for line in body.splitlines() if line]
        assert re.fullmatch(rf"\d{{4}}-\d\d-\d\d \(\[details\]\(docs/history/{name}.md\)\)", date)
        assert 0 < len(lines) <= 8, name
        words = r"- \*\*(New|Changed answers|Breaking|Known limits)\*\*: .+\."
        assert all(re.fullmatch(words, line) for line in lines), name


# -- gallery ---------------------------------------------------------------------------------------


def maker():
    spec = importlib.util.spec_from_file_location("plots_make", ROOT / "plots/make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


make = maker()


def test_every_script_has_its_picture(capsys) -> None:
    assert make.unmatched() == []
    assert make.main(["--check"]) == 0
    assert make.main(["no_such_script"]) == 2
    assert "four_bar_diagram" in capsys.readouterr().err


def test_unmatched_scripts_and_pictures_are_listed(tmp_path: Path) -> None:
    (tmp_path / "alone.py").write_text("def figure():\n    raise SystemExit\n")
    (tmp_path / "helper.py").write_text("raise SystemExit\n")
    (tmp_path / "left_over.svg").write_text("<svg/>")
    assert make.unmatched(tmp_path) == [
        "alone.py has no alone.svg",
        "left_over.svg has no left_over.py",
    ]


ANSWERS: dict[tuple[str, str], object] = {}


def once(monkeypatch, name: str) -> None:
    """Let the package compute each answer once: that it is the same again is tested elsewhere."""
    computed = getattr(md, name)

    def kept(*given, **keys):
        asked = name, repr((given, keys))
        if asked not in ANSWERS:
            ANSWERS[asked] = computed(*given, **keys)
        return ANSWERS[asked]

    monkeypatch.setattr(md, name, kept)


@pytest.mark.parametrize("path", make.scripts(), ids=lambda path: path.stem)
def test_pictures_are_the_same_each_time(path: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    for name in ("solve", "synthesize"):
        once(monkeypatch, name)
    first = make.make(path, tmp_path).read_bytes()
    assert first.startswith(b"<?xml")
    assert make.make(path, tmp_path).read_bytes() == first


def test_gallery_shows_every_picture() -> None:
    page = (ROOT / "docs/reference/gallery.md").read_text(encoding="utf-8")
    for path in make.scripts():
        assert f"../plots/{path.stem}.svg" in page
        assert f"../plots/{path.stem}.py" in page


def test_speed_page_is_what_was_measured(capsys) -> None:
    spec = importlib.util.spec_from_file_location("make_speed", ROOT / "docs/make_speed.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.main(["--check"]) == 0, capsys.readouterr().out


# -- synthesis -------------------------------------------------------------------------------------


BLOCK = """
schema = 1
ground = { points = { O = [0, 0] } }
bodies = { block = { points = { P = [0, 0] }, mass = 1 } }
joints = { guide = { kind = "prismatic", between = ["ground.O", "block.P"] } }
loads = { spring = { kind = "spring", coordinate = "guide.slide", stiffness = "k" } }
sketch = { guide = 0.1 }
parameters = { k = 100 }
"""


def test_counts_of_modes_are_what_was_measured() -> None:
    page = (ROOT / "docs/theory/evidence/assembly-modes.md").read_text(encoding="utf-8")
    for name, word, table in (
        ("all-modes", "modes", all_modes.table),
        ("counts-of-modes", "counts", counts_of_modes.table),
    ):
        data = json.loads((ROOT / f"docs/data/{name}.json").read_text(encoding="utf-8"))
        assert all_modes.between(page, word, table(data)) == page


def test_solver_page_is_what_was_measured() -> None:
    page = (ROOT / "docs/theory/evidence/solver.md").read_text(encoding="utf-8")
    data = json.loads((ROOT / "docs/data/solver.json").read_text(encoding="utf-8"))
    assert written(page, data) == page


@pytest.mark.parametrize("block", fences("docs/reference/synthesis.md", "toml"))
def test_goals_and_limits_shown_are_those_of_the_problems(block: str) -> None:
    import tomllib

    from mechdae.describe.file.load import from_dict
    from mechdae.describe.tasks.synthesis import demand

    name = re.fullmatch(r"# ([\w-]+)(, instead)?", block.split("\n")[0])
    if name is None:  # tasks beside a block on a spring
        problem = from_dict(tomllib.loads(BLOCK + block))
        assert demand(problem, problem.tasks["design"]).goals
        return
    path = library.find(name[1])
    whole = tomllib.loads(path.read_text(encoding="utf-8"))
    (task,) = tomllib.loads(block)["tasks"].values()
    if name[2] is None:
        assert {key: whole["tasks"]["design"][key] for key in task} == task
        return
    if "goals" in task:
        del whole["tasks"]["design"]["goal"]
    whole["tasks"]["design"] |= task
    problem = from_dict(whole, name[1])
    assert demand(problem, problem.tasks["design"]).goals


def test_table_of_synthesis_is_what_was_measured(capsys) -> None:
    spec = importlib.util.spec_from_file_location("make_synthesis", ROOT / "docs/make_synthesis.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.main(["--check"]) == 0, capsys.readouterr().out


# -- figures of random mechanisms ------------------------------------------------------------------


def test_tables_of_random_mechanisms_are_those_of_the_figures() -> None:
    from tests.attack import honesty

    text = (ROOT / "docs/theory/evidence/honesty.md").read_text(encoding="utf-8")
    figures = json.loads((ROOT / "docs/data/honesty.json").read_text(encoding="utf-8"))
    assert honesty.page(text, honesty.tables(figures)) == text
    assert figures["total"]["faults"] == len(figures["faults"])


def test_readme_has_the_figures_of_random_mechanisms() -> None:
    total = json.loads((ROOT / "docs/data/honesty.json").read_text(encoding="utf-8"))["total"]
    share = 1000 * total["refused"] / (total["ok"] + total["limit"] + total["refused"])
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    counts = (f"{total[name]:,}".replace(",", " ") for name in ("ok", "mechanisms"))
    assert "Of {} poses marked `ok` on {} random mechanisms none was wrong".format(*counts) in text
    assert total["faults"] == 0
    assert f"{share:.1f} of a thousand existing poses were refused" in text
