"""The session of a live page in Node.js, with the modules and the data of its file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.parts.page import link
from tests.shared.node import run_script

WEB = Path(link.__file__).parent / "web"
HARNESS = """
import {{ readFileSync }} from "node:fs";
import {{ Session }} from "{session}";
import {{ Forces }} from "{forces}";
const data = JSON.parse(readFileSync({data}, "utf8"));
import {{ scriptOf }} from "{compile}";
const K = new Function("return " + scriptOf(JSON.parse(readFileSync({tables}, "utf8"))))();
globalThis.WORDS = {words};
const session = new Session(data, K, Forces);
"""


def tables_of(html: str) -> Any:
    """Return the tables of the kernels of a page."""
    line = link.unpacked(html).split("\n")[2]
    return json.loads(line.partition(" } = ")[2].rstrip(";"))["KERNELS"]


def in_page(page: md.Page, body: str, folder: Path):
    """Return what a script prints that has the page's session."""
    data, tables = folder / "data.json", folder / "tables.json"
    data.write_text(json.dumps(dict(page.data)), encoding="utf-8")
    tables.write_text(json.dumps(tables_of(page.html)), encoding="utf-8")
    head = HARNESS.format(
        session=(WEB / "session.js").as_posix(),
        forces=(WEB / "forces.js").as_posix(),
        data=json.dumps(str(data)),
        compile=(WEB / "compile.js").as_posix(),
        tables=json.dumps(str(tables)),
        words=json.dumps(link.words_of(page.data["lang"])),
    )
    return run_script(head + body, folder)


def places_of(page: md.Page, result: md.Result) -> np.ndarray:
    """Return where the poses of a result lie on the way of a page: value, time, pose, share."""
    kind, count = page.data["way"]["kind"], len(result.status)
    if kind == "law":
        return np.asarray(result.time)
    if kind == "legs":
        whole = page.data["way"]["name"] == "pose"
        return 1.0 + np.arange(count) if whole else np.linspace(0, 1, count)
    return np.asarray(result.drivers[page.data["driver"]["name"]].position)
