"""Sources of the site: pages of the repository as they are, what they link to, the contents."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"(!?)\[((?:[^\]\\]|\\.)*)\]\(([^)\s]+)\)")

GROUPS = {
    "Start": ["README.md", "docs/which-task.md", "docs/migration.md"],
    "Describe": ["problem-file", "joints", "space", "editor", "command-line", "python"],
    "Compute": ["measures", "forces", "motion", "sensitivity", "solver", "studies", "modules"],
    "Design": ["synthesis", "synthesis-jobs", "composition", "schemes"],
    "Show": ["page", "explain", "assignments", "pictures", "symbols", "gallery", "exchange"],
    "Know": [
        "theory",
        "life-of-a-four-bar",
        "homotopy",
        "honesty",
        "certificates",
        "speed-and-error",
        "back-ends",
        "articles",
    ],
}
"""Groups of the contents with pages of ``docs/``; what is in none of them comes under "Further"."""

TUTORIALS = ["tour", "course-project", "friction-and-jamming", "synthesis", "own-optimisation"]
TITLES = {"README.md": "Tour <README>"}
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
        place.write_text(LINK.sub(lambda m, page=page: _link(m, page, target), text), "utf-8")


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


def contents(target: Path, generated: dict[str, list[str]]) -> None:
    """Write the first page: what the site holds, with the generated parts by caption."""
    there = {str(page) for page in pages()}
    groups: dict[str, list[str]] = {}
    for caption, names in GROUPS.items():
        full = [name if "." in name else f"docs/{name}.md" for name in names]
        groups[caption] = [name for name in full if name in there]
    tutorials = [f"docs/tutorials/{name}.md" for name in TUTORIALS]
    placed = {name for names in groups.values() for name in names} | set(tutorials)
    groups = {"Start": groups.pop("Start"), "Tutorials": tutorials, **groups}
    groups |= generated
    groups["Further"] = sorted(there - placed - set(ELSEWHERE)) + ELSEWHERE
    text = (Path(__file__).parent / "first.md").read_text(encoding="utf-8")
    for caption, names in groups.items():
        if names:
            lines = "\n".join(TITLES.get(name, name.rpartition(".")[0]) for name in names)
            text += f"\n```{{toctree}}\n:caption: {caption}\n:maxdepth: 1\n\n{lines}\n```\n"
    (target / "index.md").write_text(text, encoding="utf-8")
