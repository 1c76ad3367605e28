"""Prints the words of the documentation by part, and its long sentences.

``python docs/count_words.py`` counts words that hold a letter or a digit, code and tables too.
Pages of evidence, generated pages and the history are counted apart.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
PARTS = ("tutorials", "how-to", "reference", "theory", "theory/evidence", "history")
GENERATED = {"keys.md", "commands.md", "gallery.md", "life-of-a-four-bar.md"}
LONGEST = 40
"""Most words of a sentence outside of theory."""


def words(text: str) -> int:
    """Return how many words with a letter or a digit a text has."""
    return sum(1 for word in text.split() if re.search(r"\w", word))


def prose(text: str) -> str:
    """Return a page without code, tables, pictures and addresses of links."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.S | re.M)
    text = re.sub(r"^(\||#|!\[|    ).*$", "", text, flags=re.M)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    return re.sub(r"\]\([^)]*\)", "]", text)


def sentences(text: str) -> Iterator[str]:
    """Yield the sentences of a page; an item of a list begins one."""
    for block in re.split(r"\n\s*\n|^\s*(?:[-*]|\d+\.) ", prose(text), flags=re.M):
        for sentence in re.split(r"(?<=[.:;?!])\s+(?=[A-Z`*\[(Φ])", " ".join(block.split())):
            if words(sentence) > 2:
                yield sentence


def pages(part: str) -> list[Path]:
    """Return the pages of a part, without the generated ones."""
    return [page for page in sorted((DOCS / part).glob("*.md")) if page.name not in GENERATED]


def main() -> int:
    """Print the words by part and page."""
    total = 0
    for part in PARTS:
        each = {page.name: words(page.read_text(encoding="utf-8")) for page in pages(part)}
        if part not in ("theory/evidence", "history"):
            total += sum(each.values())
        print(f"{part:16} {sum(each.values()):6}")
        if "--pages" in sys.argv:
            for name, count in each.items():
                print(f"    {name:24} {count:6}")
    made = [page for part in PARTS for page in (DOCS / part).glob("*.md") if page.name in GENERATED]
    print(f"{'generated':16} {sum(words(page.read_text(encoding='utf-8')) for page in made):6}")
    for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md"):
        print(f"{name:16} {words((ROOT / name).read_text(encoding='utf-8')):6}")
    print(f"{'manual':16} {total:6}  (tutorials, how-to, reference, theory)")
    for part in ("tutorials", "how-to", "reference"):
        every = [s for page in pages(part) for s in sentences(page.read_text(encoding="utf-8"))]
        counts = [words(sentence) for sentence in every]
        over = sum(count > LONGEST for count in counts)
        print(f"{part:16} {sum(counts) / len(counts):.1f} words a sentence, {over} over {LONGEST}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
