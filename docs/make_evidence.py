"""Writes below each heading of ``docs/theory/evidence`` when its figures were measured.

``python docs/make_evidence.py`` writes, with ``--check`` the exit code is 1 where a page or a file
of data is not what ``docs/data/measured.json`` says. A file of data that changed is of today and of
this version, or of the version that it holds. Pages that the tests compute anew have no dates.
"""

from __future__ import annotations

import datetime
import json
import re
import sys
import zlib
from pathlib import Path
from typing import Any

import mechdae

DOCS = Path(__file__).resolve().parent
PAGES, DATA = DOCS / "theory/evidence", DOCS / "data"
HELD = DATA / "measured.json"
ANEW = {"articles.md"}
"""Pages whose figures are computed by the tests."""
HEADING = re.compile(r"^(#+ .*\n)(?:\n\*Figures of .*\*\n)?", re.M)
MENTION = re.compile(r"data/([\w-]+\.json)")


def held() -> dict[str, Any]:
    """Return what is known: ``data`` by file, ``sections`` by page and heading."""
    known: dict[str, Any] = json.loads(HELD.read_text(encoding="utf-8"))
    return known


def renewed(known: dict[str, Any]) -> dict[str, Any]:
    """Return what is known of each file of data, with those that changed as of today."""
    files = {}
    for path in sorted(DATA.glob("*.json")):
        if path != HELD:
            text = path.read_bytes()
            before = known.get(path.name, {})
            files[path.name] = before if before.get("sum") == zlib.crc32(text) else _new(text)
    return files


def _new(text: bytes) -> dict[str, Any]:
    data = json.loads(text)
    version = data.get("version") if isinstance(data, dict) else None
    date = datetime.date.today().isoformat()
    return {"version": version or mechdae.__version__, "date": date, "sum": zlib.crc32(text)}


def sections(text: str) -> list[tuple[str, str]]:
    """Return headings of a page with the text below each; code is no heading."""
    plain = re.sub(
        r"^```.*?^```$", lambda code: re.sub(r"\S", "x", code[0]), text, flags=re.S | re.M
    )
    starts = [found.start() for found in HEADING.finditer(plain)]
    ends = [*starts[1:], len(text)]
    return [(text[a:b].partition("\n")[0], text[a:b]) for a, b in zip(starts, ends, strict=True)]


def stamped(name: str, text: str, known: dict[str, Any] | None = None) -> str:
    """Return a page with what is known of its sections below their headings."""
    known = known or held()
    parts = []
    for heading, section in sections(text):
        row = known["sections"].get(f"{name} {heading}", {})
        files = dict.fromkeys([*row.get("data", ()), *MENTION.findall(section)])
        said = [_said(known["data"][file], file) for file in files if file in known["data"]]
        said += [_said(row)] if "version" in row else []
        line = f"\n*Figures of {'; '.join(said)}.*\n" if said else ""
        parts.append(HEADING.sub(lambda found, line=line: found[1] + line, section, count=1))
    return "".join(parts)


def _said(row: dict[str, Any], file: str = "") -> str:
    link = f" ([{file}](../../data/{file}))" if file else ""
    return f"{row['version']}, {row['date']}{link}"


def main(arguments: list[str]) -> int:
    """Write pages and table, or say whether they are current."""
    known = held()
    wanted = known | {"data": renewed(known["data"])}
    texts = {HELD: json.dumps(wanted, indent=1) + "\n"}
    for page in sorted(PAGES.glob("*.md")):
        if page.name not in ANEW:
            texts[page] = stamped(page.name, page.read_text(encoding="utf-8"), wanted)
    old = [path for path, text in texts.items() if path.read_text(encoding="utf-8") != text]
    if "--check" in arguments:
        print("\n".join(f"{path.name} is old: python docs/make_evidence.py" for path in old))
        return int(bool(old))
    for path in old:
        path.write_text(texts[path], encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
