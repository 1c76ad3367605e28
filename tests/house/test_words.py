"""Plain English and the words of the field: short sentences, a list of words to avoid, budgets."""

from __future__ import annotations

import importlib.util
import re
import tokenize
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.shared.paths import DOCS, ROOT, document_pages


def counting() -> Any:
    spec = importlib.util.spec_from_file_location("count_words", DOCS / "count_words.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


COUNT = counting()
LIST = Path(__file__).with_name("words.toml").read_text(encoding="utf-8")
AVOID = tomllib.loads(LIST)["avoid"]
EVERYWHERE = tomllib.loads(LIST)["everywhere"]["avoid"]
PACKAGE = ROOT / "mechdae"
EVIDENCE = DOCS / "theory/evidence"
WRITTEN = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *(p for p in document_pages() if p.parent != EVIDENCE and p.name not in COUNT.GENERATED),
]


def slips(text: str) -> list[str]:
    """Return the words of a page that are to be avoided, with what to write."""
    plain = re.sub(r"```.*?```|`[^`\n]*`|\]\([^)]*\)", " ", text, flags=re.S)
    plain = " ".join(plain.split())
    return [
        f"{word}: {better} ({plain[max(0, found.start() - 40) : found.end() + 20]})"
        for word, better in AVOID.items()
        for found in re.finditer(rf"\b{word}\b", plain, re.I)
    ]


def test_slips_are_seen_and_code_is_free() -> None:
    assert slips("what is sought\nhere") == ["sought: unknown, wanted (what is sought here)"]
    assert not slips("`sought` is a name, resought too [x](beside.md)")


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.stem)
def test_documents_use_the_words_of_the_field(page: Path) -> None:
    assert not slips(page.read_text(encoding="utf-8"))


@pytest.mark.parametrize("part", ["tutorials", "how-to", "reference"])
def test_sentences_are_short(part: str) -> None:
    counts = []
    for page in COUNT.pages(part):
        for sentence in COUNT.sentences(page.read_text(encoding="utf-8")):
            assert COUNT.words(sentence) <= COUNT.LONGEST, f"{page.name}: {sentence[:80]}"
            counts.append(COUNT.words(sentence))
    assert sum(counts) / len(counts) <= 25


def test_the_manual_can_be_read() -> None:
    """Words without generated pages and evidence."""
    parts = ("tutorials", "how-to", "reference", "theory")
    pages = [page for part in parts for page in COUNT.pages(part)]
    total = sum(COUNT.words(page.read_text(encoding="utf-8")) for page in pages)
    assert total <= 45_000
    for name, most in (("README.md", 1200), ("CONTRIBUTING.md", 1500)):
        assert COUNT.words((ROOT / name).read_text(encoding="utf-8")) <= most, name


def spoken(path: Path) -> list[str]:
    """Return what a module says: strings that are no keys, and comments."""
    with path.open("rb") as file:
        tokens = list(tokenize.tokenize(file.readline))
    return [
        token.string
        for token in tokens
        if token.type == tokenize.COMMENT
        or (token.type == tokenize.STRING and " " in token.string.strip("\"' "))
    ]


@pytest.mark.parametrize("room", sorted(p.name for p in PACKAGE.iterdir() if p.suffix != ".pyi"))
def test_messages_and_docstrings_use_them_too(room: str) -> None:
    """Of the words to avoid those without another use; names and keys of results stay."""
    home = PACKAGE / room
    for path in home.rglob("*.py") if home.is_dir() else [home]:
        for text in spoken(path):
            plain = re.sub(r"``[^`]*``|`[^`]*`|\{[^}]*\}|[\"'][\w.]+[\"']", " ", text)
            for word in EVERYWHERE:
                assert not re.search(rf"(?<![./\w]){word}(?![./]\w)\b", plain, re.I), (
                    f"{path}: {text[:90]}"
                )


def test_a_word_to_avoid_is_seen_in_a_message(tmp_path: Path) -> None:
    file = tmp_path / "module.py"
    file.write_text('fail("superfluous equations")  # solved anew\nkey = "superfluous"\n')
    assert spoken(file) == ['"superfluous equations"', "# solved anew"]
