"""A public language server for TOML checks files by the schema and completes a joint."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from mechdae.describe.file.schema import compact, schema

SERVER = shutil.which("tombi")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(SERVER is None, reason="no language server: pip install tombi"),
]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    text = json.dumps(compact(schema()), separators=(",", ":"))
    (tmp_path / "mechdae.schema.json").write_text(text, encoding="utf-8")
    return tmp_path


def file_with(old: str, new: str) -> str:
    text = md.new("four-bar")
    assert text.count(old) >= 1
    return "#:schema ./mechdae.schema.json\n" + text.replace(old, new, 1)


def checked(folder: Path, text: str) -> subprocess.CompletedProcess[str]:
    path = folder / "linkage.toml"
    path.write_text(text, encoding="utf-8")
    words = [str(SERVER), "lint", "--offline", path.name]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True)


def test_a_mistake_is_found_where_it_stands(folder: Path) -> None:
    joint = 'kind = "revolute"'
    assert checked(folder, file_with(joint, joint)).returncode == 0
    found = checked(folder, file_with(joint, 'kind = "revolut"'))
    assert found.returncode != 0
    assert '"revolut"' in found.stderr


class Server:
    """A language server on its standard streams."""

    def __init__(self, folder: Path) -> None:
        self.process = subprocess.Popen(
            [str(SERVER), "lsp", "--offline"], cwd=folder,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.count = 0

    def _write(self, message: dict[str, Any]) -> None:
        assert self.process.stdin
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self.process.stdin.flush()

    def _read(self) -> dict[str, Any]:
        assert self.process.stdout
        size = 0
        while line := self.process.stdout.readline().strip():
            name, _, value = line.partition(b":")
            size = int(value) if name == b"Content-Length" else size
        assert size, "the server ended"
        return json.loads(self.process.stdout.read(size))

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()

    def tell(self, method: str, **params: Any) -> None:
        self._write({"method": method, "params": params})

    def ask(self, method: str, **params: Any) -> Any:
        """Return the answer; what the server asks meanwhile is answered with nothing."""
        self.count += 1
        self._write({"id": self.count, "method": method, "params": params})
        while True:
            said = self._read()
            if "method" in said and "id" in said:
                asked = said["params"].get("items", []) if said["params"] else []
                self._write({"id": said["id"], "result": [None] * len(asked) or None})
            elif said.get("id") == self.count:
                return said["result"]


@pytest.fixture
def server(folder: Path) -> Iterator[Server]:
    started = Server(folder)
    try:
        started.ask("initialize", processId=None, rootUri=folder.as_uri(), capabilities={})
        started.tell("initialized")
        yield started
    finally:
        started.close()


def completed(server: Server, folder: Path, text: str, mark: str) -> dict[str, str]:
    """Return what is offered behind a mark, with the documentation of each."""
    place = text.index(mark) + len(mark)
    before = text[:place]
    uri = (folder / "linkage.toml").as_uri()
    given = {"uri": uri, "languageId": "toml", "version": 1, "text": text}
    server.tell("textDocument/didOpen", textDocument=given)
    position = {"line": before.count("\n"), "character": len(before.rpartition("\n")[2])}
    found = server.ask("textDocument/completion", textDocument={"uri": uri}, position=position)
    items = found["items"] if isinstance(found, dict) else found or []
    return {item["label"]: json.dumps(item.get("documentation", "")) for item in items}


def test_a_joint_is_completed(server: Server, folder: Path) -> None:
    joint = 'A = { kind = "revolute", between = ["ground.A", "crank.A"] }'
    text = file_with(joint, 'A = { kind = "revolute",  }')
    offered = completed(server, folder, text, 'kind = "revolute", ')
    assert {"between", "friction", "pin_radius", "clearance"} <= {*offered}
    assert "radius of the pin" in offered["pin_radius"]
    assert not {"tasks", "drivers", "points"} & {*offered}
