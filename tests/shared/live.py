"""The session of a live page in Node.js, with the modules and the data of its file."""

from __future__ import annotations

import json
from pathlib import Path

import mechdae as md
from mechdae.pages import link
from tests.shared.node import run_script

WEB = Path(link.__file__).parent / "web"
HARNESS = """
import {{ readFileSync }} from "node:fs";
import {{ Session }} from "{session}";
const html = readFileSync({page}, "utf8");
const data = JSON.parse(html.split('id="mechdae">')[1].split("</script>")[0]);
const code = html.split("<script>")[1].split("</script>")[0].replaceAll("<\\\\/", "</");
const end = "}})();\\n";
const kernels = code.slice(code.indexOf("const K ="), code.indexOf(end) + end.length);
const K = new Function(kernels.replace("const K =", "return"))();
const session = new Session(data, K);
"""


def in_page(page: md.Page, body: str, folder: Path):
    """Return what a script prints that has the page's session."""
    file = page.save(folder / "page.html")
    head = HARNESS.format(session=(WEB / "session.js").as_posix(), page=json.dumps(str(file)))
    return run_script(head + body, folder)
