"""Write ``articles.md``: three published analyses of mechanisms, recomputed.

Typed are only the numbers the articles print, with their place, and sentences; every
other number of the page is computed when the page is made, by mechdae or by arithmetic on
the printed ones. Run ``python docs/make_articles.py`` to write the page, with ``--check`` to
compare it with the one on disk (exit code 1 when they differ).
"""

from __future__ import annotations

import sys
from pathlib import Path

import article_explained
import article_friction
import article_geared
import article_seven_link

PAGE = Path(__file__).with_name("theory") / "evidence/articles.md"


def page() -> str:
    """Return the page."""
    lines = [
        "# Three articles, checked",
        "",
        "Written by `docs/make_articles.py`; do not edit. The printed numbers are typed into "
        "that script, all others are computed when the page is made.",
        "",
        "**Verdicts.** *Exact to print*: within half a unit of the last printed digit of what "
        "mechdae computes. *Rounding*: within two units of it and within 1 %, as rounded "
        "intermediate results explain. *Deviates*: anything else, with the reason. Deviations are "
        "(printed − computed)/computed.",
        "",
        *article_seven_link.lines(),
        *article_explained.lines(),
        *article_friction.lines(),
        *article_geared.lines(),
    ]
    return "\n".join(lines).rstrip() + "\n"


def differences(new: str, old: str) -> list[str]:
    """Return the lines in which two pages differ."""
    a, b = new.splitlines(), old.splitlines()
    size = max(len(a), len(b))
    a, b = a + [""] * (size - len(a)), b + [""] * (size - len(b))
    return [f"{k + 1}: {y!r} should be {x!r}" for k, (x, y) in enumerate(zip(a, b, strict=True))
            if x != y]  # fmt: skip


def main(arguments: list[str]) -> int:
    """Write or check the page; return the exit code."""
    new = page()
    if "--check" not in arguments:
        PAGE.write_text(new, encoding="utf-8")
        return 0
    old = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    found = differences(new, old)
    for line in found[:20]:
        print(line, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
