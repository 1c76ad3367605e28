"""The manual: pages made from the package are current, examples run, sentences are short."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from mechdae.tasks.check import check
from tests.shared.paths import DOCS, ROOT, document_pages


def script(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_page_of_keys_is_that_of_the_schema() -> None:
    assert script("make_keys").main(["--check"]) == 0, "python docs/make_keys.py"


def test_page_of_commands_is_what_they_say() -> None:
    assert script("make_commands").written(["--check"]) == 0, "python docs/make_commands.py"


def test_gallery_is_that_of_the_scripts() -> None:
    assert script("make_gallery").main(["--check"]) == 0, "python docs/make_gallery.py"


# -- for programs ----------------------------------------------------------------------------------

PROGRAMS = DOCS / "reference/for-programs.md"
TEXT = PROGRAMS.read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```toml\n(schema = 1\n.*?)^```$", TEXT, re.S | re.M)


def test_the_page_for_programs_is_short_and_has_ten_examples() -> None:
    assert len(EXAMPLES) == 10
    assert len(TEXT.split()) <= 6000


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda text: text.split('"')[1][:20])
def test_examples_for_programs_run(example: str, tmp_path: Path) -> None:
    path = tmp_path / "example.toml"
    path.write_text(example, encoding="utf-8")
    problem = md.load(path)
    assert problem.tasks
    for name in problem.tasks:
        result = md.solve(problem, name)
        assert result.fault is None, name
        assert set(result.status) == {"ok"}, name
    assert all(verdict.met for verdict in check(problem))


@pytest.mark.parametrize(
    ("number", "right", "wrong", "answer"),
    [
        (1, "coupler_deg = 20\nrocker_deg = 80", "coupler = 20\nrocker = 80", "_deg"),
        (1, 'D = { kind = "revolute", between = ["ground.D", "rocker.D"] }', "", "missing"),
        (1, '["crank.B", "coupler.B"]', '["crank.B", "B"]', "B"),
        (2, "gravity = [0, -9.81]", "gravity = 9.81", "list"),
        (2, ", pin_radius_mm = 8", "", "pin_radius"),
        (4, 'E = { kind = "revolute", between = ["ground.E", "right.E"] }', "", "missing"),
    ],
)  # fmt: skip
def test_common_mistakes_are_answered(
    number: int, right: str, wrong: str, answer: str, tmp_path: Path
) -> None:
    example = EXAMPLES[number - 1]
    assert right in example
    path = tmp_path / "example.toml"
    path.write_text(example.replace(right, wrong), encoding="utf-8")
    with pytest.raises(md.MechdaeError, match=re.escape(answer)):
        md.solve(path)


# -- what programs are told to read ----------------------------------------------------------------


def test_files_that_llms_txt_names_are_there() -> None:
    text = (ROOT / "llms.txt").read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)#]+)[^)]*\)", text)
    assert len(links) > 8
    assert all((ROOT / link).exists() for link in links)


# -- every documented key is there, and every key is documented ------------------------------------


def test_keys_of_the_schema_stand_in_pages_written_by_hand() -> None:
    """Each key once where it is explained, not only in the generated table."""
    generated = {"keys.md", "commands.md"}
    pages = [page for page in document_pages() if page.name not in generated]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    keys = set(re.findall(r"^\| \**`(\w+)`", (DOCS / "reference/keys.md").read_text(), re.M))
    assert len(keys) > 150
    named = set(re.findall(r"\w+", text))
    assert keys <= named, keys - named


OF_EXPECTED_AND_CELLS = {"task", "what", "rel", "abs", "value", "source", "time", "count", "from"}


def test_keys_named_in_tables_exist() -> None:
    """In the column of keys of the reference: what the file does not take is not promised."""
    keys = set(re.findall(r"^\| \**`(\w+)`", (DOCS / "reference/keys.md").read_text(), re.M))
    found = 0
    for name in ("problem-file", "tasks", "vector-loops", "joints", "motion"):
        text = (DOCS / f"reference/{name}.md").read_text(encoding="utf-8")
        for table in re.findall(
            r"^\| keys?(?: of [^|]*)? \|[^\n]*\n\|[-|]+\n((?:\|.*\n)+)", text, re.M
        ):
            for row in table.splitlines():
                cell = row.split("|")[1]
                named = set(re.findall(r"`(\w+)`", cell))
                assert named <= keys | OF_EXPECTED_AND_CELLS, (name, row)
                found += len(named)
    assert found > 40
