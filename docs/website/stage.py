"""Sources of the site: pages of the repository as they are, what they link to, the contents."""

from __future__ import annotations

import html
import re
import shutil
import tomllib
from pathlib import Path

from website import cards

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"(!?)\[((?:[^\]\\]|\\.)*)\]\(([^)\s]+)\)")

GROUPS = {
    "Tutorials": ["tutorials"],
    "How to": ["how-to"],
    "Reference": ["reference"],
    "Theory and evidence": ["theory", "theory/evidence"],
}
"""Groups of the contents with folders of ``docs/``."""

FIRST = [
    "README.md",
    "docs/tutorials/tour.md",
    *(
        f"docs/how-to/{name}.md"
        for name in (
            "which-task", "draw", "drivers", "modes", "torque", "dimensions", "solver",
            "moves-by-itself", "in-space", "exchange", "assignments", "prove",
        )
    ),
    "docs/reference/problem-file.md",
    "docs/theory/theory.md",
]  # fmt: skip
"""What comes first in its group, in this order; the rest follows by name."""

HISTORY, GALLERY = Path("docs/history"), Path("docs/reference/gallery.md")
ORPHAN = "---\norphan: true\n---\n\n"
"""What is linked to and in no contents."""

TITLES = {"README.md": "First steps <README>"}
ELSEWHERE = ["CHANGELOG.md", "CONTRIBUTING.md"]


def pages() -> list[Path]:
    """Return the pages of the repository that the site shows, relative to its root."""
    own = sorted(path.relative_to(ROOT) for path in (ROOT / "docs").glob("**/*.md"))
    own = [path for path in own if path != Path("docs/index.md") and "website" not in path.parts]
    return [Path("README.md"), *map(Path, ELSEWHERE), *own]


def stage(target: Path) -> None:
    """Copy the pages with what they link to into a tree like that of the repository."""
    for page in pages():
        text = (ROOT / page).read_text(encoding="utf-8")
        place = target / page
        place.parent.mkdir(parents=True, exist_ok=True)
        text = LINK.sub(lambda m, page=page: _link(m, page, target), text)
        head = ORPHAN if page.parent == HISTORY else ""
        if page == GALLERY:
            text = text.replace("\n## ", f"\n{cards.gallery()}\n## ", 1)
        place.write_text(head + text, encoding="utf-8")


def _link(found: re.Match[str], page: Path, target: Path) -> str:
    """Return a link as the site has it; files it leads to are copied."""
    mark, words, link = found.groups()
    if re.match(r"[a-z]+:|#", link):
        return found.group(0)
    place, _, anchor = link.partition("#")
    source = (ROOT / page).parent.joinpath(place).resolve()
    if source == ROOT / "docs/index.md":
        return f"[{words}]({_up(page)}index.md)"
    if source.is_dir():
        return words
    if source.suffix == ".md" or not source.exists():
        return found.group(0)
    copy = target / source.relative_to(ROOT)
    copy.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, copy)
    return f"{mark}[{words}]({place})" if anchor else found.group(0)


def _up(page: Path) -> str:
    return "../" * (len(page.parts) - 1)


def contents(target: Path, generated: dict[str, list[str]], top: str = "") -> None:
    """Write the first page: its top, what the site holds, the generated parts by caption."""
    groups: dict[str, list[str]] = {}
    for caption, folders in GROUPS.items():
        full = [
            page for page in pages() if str(page.parent) in [f"docs/{name}" for name in folders]
        ]
        full += [Path("README.md")] if caption == "Tutorials" else []
        full.sort(key=lambda page: (_rank(str(page)), len(page.parts), str(page)))
        groups[caption] = [*map(str, full), *generated.get(caption, [])]
    groups["Project"] = [*ELSEWHERE]
    text = (Path(__file__).parent / "first.md").read_text(encoding="utf-8")
    text = text.replace("{top}", top)
    for caption, names in groups.items():
        if names:
            lines = "\n".join(TITLES.get(name, name.rpartition(".")[0]) for name in names)
            text += f"\n```{{toctree}}\n:caption: {caption}\n:hidden:\n\n{lines}\n```\n"
    (target / "index.md").write_text(text, encoding="utf-8")


def _rank(name: str) -> int:
    return FIRST.index(name) if name in FIRST else len(FIRST)


def redirects(target: Path) -> None:
    """Write a page for each former name that leads on to the page of today."""
    moved = tomllib.loads((Path(__file__).parent / "moved.toml").read_text(encoding="utf-8"))
    for name, today in moved.items():
        place = target / "docs" / f"{name}.html"
        place.parent.mkdir(parents=True, exist_ok=True)
        link = html.escape(f"{_up(Path(name))}{today}.html")
        place.write_text(
            f'<!DOCTYPE html><meta charset="utf-8"><title>{html.escape(name)}</title>'
            f'<meta http-equiv="refresh" content="0; url={link}"><a href="{link}">{link}</a>\n',
            encoding="utf-8",
        )
