"""Writes `life-of-a-four-bar.md`: the files that a planar four-bar enters, in their order.

``python docs/make_life.py``, with ``--check`` it says whether the page is what a trace gives.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from tests.shared.walk import PACKAGE, four_bar

PAGE = Path(__file__).with_name("theory") / "life-of-a-four-bar.md"
HEAD = """# The life of a four-bar

What happens between `mechdae solve four-bar-crank-rocker --task turn` and its table, file by file,
in the order in which they are first entered, for whoever wants to read the code: the plain way,
without what only some mechanisms have. The list is traced, not written (`docs/make_life.py`);
figures of the way are held by `tests/house/test_life.py`: {files} files of {rooms} rooms, {changes}
changes of file from one call to the next, and {share:.0f} % of the statements that stand in the
functions of these files are run.

In words: the command line reads the file into a frozen description; the model turns it into
symbols, residuals of joints and groups, and eliminates what is constant; kernels are built of what
is left; the assembler finds the pose that the sketch chooses; the path follows it in proved steps;
poses between them are solved and bounded; a result is made of them, and a table of the result.
"""


def purpose(file: str) -> str:
    """Return the first sentence of a module's docstring."""
    text = ast.get_docstring(ast.parse((PACKAGE / file).read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())


def listed(text: str) -> list[str]:
    """Return the lines of a page that are lists and their heads."""
    return [line for line in text.splitlines() if line.startswith(("- `", "**"))]


def page() -> str:
    """Return the text of the page."""
    way = four_bar()
    lines = [
        HEAD.format(
            files=len(way["files"]), rooms=len(way["rooms"]),
            changes=f"{round(way['changes'], -2):,}".replace(",", " "), share=100 * way["share"],
        )
    ]  # fmt: skip
    for room, files in groupby(way["files"], key=lambda file: file.rpartition("/")[0]):
        lines.append(f"\n**{room or 'beside the rooms'}**\n")
        lines += [f"- `{file.rpartition('/')[2]}`: {purpose(file)}" for file in files]
    return "\n".join(lines) + "\n"


def main(argv: Sequence[str] | None = None) -> int:
    """Write the page, or compare its lists."""
    text = page()
    if "--check" in (sys.argv[1:] if argv is None else argv):
        return int(listed(PAGE.read_text(encoding="utf-8")) != listed(text))
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
