"""Node.js as a process that opens one page after the other and answers questions about each."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from types import TracebackType
from typing import Any

import mechdae as md
from mechdae.parts.page import link
from tests.shared.live import tables_of
from tests.shared.node import NODE

WEB = Path(link.__file__).parent / "web"
OPENS = """
import {{ createInterface }} from "node:readline";
import {{ Session }} from "{session}";
import {{ Forces }} from "{forces}";
import {{ scriptOf }} from "{compile}";
for await (const line of createInterface({{ input: process.stdin }})) {{
  let answer;
  try {{
    const {{ data, tables, words, question }} = JSON.parse(line);
    globalThis.WORDS = words;
    const K = new Function("return " + scriptOf(tables))();
    const session = new Session(data, K, Forces);
    answer = {{ found: new Function("session", "data", question)(session, data) }};
  }} catch (error) {{
    answer = {{ error: String(error.stack || error) }};
  }}
  process.stdout.write(JSON.stringify(answer) + "\\n");
}}
"""


class Player:
    """Opens pages in one process of Node.js.

    Use it with ``with``; ``asks`` is the body of a function of ``session`` and ``data``.
    """

    def __init__(self, folder: Path) -> None:
        assert NODE is not None
        script = folder / "player.mjs"
        modules = {
            name: (WEB / f"{name}.js").as_posix() for name in ("session", "forces", "compile")
        }
        script.write_text(OPENS.format(**modules), encoding="utf-8")
        self.process = subprocess.Popen(
            [NODE, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __enter__(self) -> Player:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        raised: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait(10)
        self.process.stdout.close()

    def asks(self, page: md.Page, question: str, tables: Any = None) -> Any:
        """Return what the function returns, as JSON knows it: NaN and infinities are None.

        ``tables`` take the place of those of the page's kernels.
        """
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        words = link.words_of(page.data["lang"])
        tables = tables or tables_of(page.html)
        message = {"data": dict(page.data), "tables": tables, "words": words, "question": question}
        line = json.dumps(message)
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer["found"]
