"""Joins the modules of a page, its data and its kernels to one HTML file.

The modules are plain ES modules. They are put one after the other in the order of their imports,
without ``import`` lines and the word ``export``: no two of them have the same top-level name.
With the kernels they are deflated; the page unpacks them when it is opened.
"""

from __future__ import annotations

import base64
import html
import json
import re
import tomllib
import zlib
from functools import cache
from pathlib import Path
from posixpath import dirname, join, normpath
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from mechdae.types import Floats, Json


WEB = Path(__file__).resolve().parent / "web"
OPENING = '<script type="application/json" id="mechdae">'
IMPORT = re.compile(r'^import \{([^}]*)\} from "(\.{1,2}/[\w/]+)\.js";\n', re.M)
LOADER = """\
<script>"use strict";
(() => {
%s
window.mechdae = { ready: inflated("%s").then((text) => {
const script = document.createElement("script");
script.textContent = text;
document.body.append(script);
return window.mechdae.live !== undefined && window.mechdae.ready;
}).catch(() => {
document.getElementById("status").textContent = "the file was altered";
return false;
}) };
})();
</script>"""
PACKED = re.compile(r'inflated\("([^"]*)"\)')
COMMENTS = re.compile(r"^\s*/\*\*.*?\*/\n|^\s*//[^\n]*\n", re.M | re.S)
MAIN, SPATIAL = "planar_page", "spatial_page"
FRAMES = {MAIN: "page.html", SPATIAL: "page.html", "edit": "edit.html"}
"""The module that begins, and the file that it works in."""
STYLES = {MAIN: ["page.css"], SPATIAL: ["page.css"], "edit": ["page.css", "lesson.css", "edit.css"]}


STORED = ("checks", "recorded", "file", "entries", "kernels", "lesson")
"""Data that are packed with the modules."""
DRAWN, COMPARED = 22, 15
"""Binary digits of what is only drawn, decimal ones of what is compared."""


def linked(data: Json, kernels: Json | None, main: str = MAIN, drawing: Json | None = None) -> str:
    """Return the page; the same data give the same text.

    ``kernels`` are tables of functions; ``main`` is the module that begins, and its ``.html``
    what is filled; ``drawing`` what it draws by, which is packed with the modules.
    """
    stored = {key: data[key] for key in STORED if key in data and main != "edit"}
    rest = {key: value for key, value in data.items() if key not in stored}
    if "recorded" in stored:
        stored["recorded"] = _drawn(stored["recorded"])
    text = json.dumps(rest, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    paged = main in (MAIN, SPATIAL)
    inside = text.replace("<", "\\u003c")
    look = (WEB / "lesson.css").read_text(encoding="utf-8") if paged else ""
    known: Json = {
        "WORDS": words_of(str(data["lang"]), main),
        "DRAWING": drawing,
        "LOOK": look,
        "KERNELS": kernels,
    }
    known |= {"SUM": zlib.crc32(inside.encode()), "STORED": stored}
    constants = json.dumps(known, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    total = f"const {{ {', '.join(known)} }} = {constants};\n"
    script = f'"use strict";\n(() => {{\n{total}{modules(main)}}})();\n'
    parts = {
        "title": html.escape(str(data["title"]), quote=False),
        "lang": str(data["lang"]),
        "style": "".join((WEB / name).read_text(encoding="utf-8") for name in STYLES[main]),
        "data": OPENING + inside + "</script>",
        "script": packed(script),
    }
    page = (WEB / FRAMES[main]).read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], page)


@cache
def words_of(lang: str, main: str = MAIN) -> dict[str, str]:
    """Return the words of a page or of the editor in a language, by their keys."""
    found: dict[str, str] = _words()[lang]["page"]
    return found | _words()[lang]["edit"] if main == "edit" else found


def said(key: str, lang: str, **facts: object) -> str:
    """Return why a page plays recorded poses, or shows no forces, "" without a key."""
    return _words()[lang]["reasons"][key].format(**facts) if key else ""


@cache
def _words() -> dict[str, dict[str, dict[str, str]]]:
    return tomllib.loads((WEB / "words.toml").read_text(encoding="utf-8"))


def rounded(values: Floats) -> list[float | None]:
    """Return numbers with the digits that are compared, None for those that are not finite."""
    return [float(f"{v:.{COMPARED}g}") if np.isfinite(v) else None for v in values]


def _drawn(recorded: Json) -> Json:
    """Return recorded poses as they are stored.

    Numbers that another name of the same table has before are ``{"like": name}``.
    """
    rows, found = len(recorded["rows"]), dict(recorded)
    for kind in ("points", "turns", "angles"):
        first: dict[str, str] = {}
        found[kind] = {
            name: {"like": first[key]}
            if first.setdefault(key := str(values), name) != name
            else _bent(values, rows)
            for name, values in recorded[kind].items()
        }
    if "series" in recorded:
        found["series"] = [
            [*head, [_bent(values, rows) for values in tracks]]
            for *head, tracks in recorded["series"]
        ]
    return found


def _bent(numbers: list[float | None], rows: int) -> Json | list[float | None]:
    """Return numbers as second differences of rows, those that are not finite as they are."""
    values = np.array(numbers, float)
    size = float(np.abs(values).max(initial=0.0))
    if not np.isfinite(size) or size == 0:
        return rounded(values)
    step = 2.0 ** (np.floor(np.log2(size)) - DRAWN)
    whole = np.rint(values / step).astype(int).reshape(rows, -1)
    still = np.zeros((2, whole.shape[1]), int)
    bent = np.diff(np.vstack([still, whole]), n=2, axis=0)
    return {"step": float(step), "width": whole.shape[1], "bent": bent.ravel().tolist()}


def packed(script: str) -> str:
    """Return the element of a page that unpacks a script and runs it."""
    inside = base64.b85encode(zlib.compress(script.encode(), 9)).decode().replace("<", ".")
    return LOADER % (modules("inflate"), inside)


def unpacked(page: str) -> str:
    """Return the script of a page: its kernels and its modules."""
    found = PACKED.search(page)
    assert found is not None
    return zlib.decompress(base64.b85decode(found[1].replace(".", "<"))).decode()


@cache
def modules(main: str = MAIN) -> str:
    """Return all modules as one script, each after those that it imports."""
    return _short(re.sub(r"^export ", "", "".join(sources(main).values()), flags=re.M))


def sources(main: str) -> dict[str, str]:
    """Return the modules by their names without imports, each after those that it imports."""
    texts: dict[str, str] = {}

    def put(name: str) -> None:
        if name in texts:
            return
        text = (WEB / f"{name}.js").read_text(encoding="utf-8")
        for _, other in IMPORT.findall(text):
            put(normpath(join(dirname(name), other)))
        texts[name] = IMPORT.sub("", text)

    put(main)
    return texts


def _short(text: str) -> str:
    """Return a script without comments and indentation, which nobody needs in a page."""
    return re.sub(r"^ +", "", COMMENTS.sub("", text), flags=re.M)
