"""Firefox without a window, spoken to over its own port (WebDriver BiDi), as the tests' pages."""

from __future__ import annotations

import base64
import json
import os
import shutil
import socket
import struct
import subprocess
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
BOX = """(() => { const box = document.querySelector(%s).getBoundingClientRect();
  return JSON.stringify({ x: box.x, y: box.y, width: box.width, height: box.height }); })()"""
KEYS = {"Escape": "\ue00c", "Control": "\ue009", "Shift": "\ue008", "Delete": "\ue017"}
TEXT, CLOSES = 1, 8


class Socket:
    """The client's side of a web socket (RFC 6455): texts there and back."""

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        assert parts.hostname is not None
        assert parts.port is not None
        self.stream = socket.create_connection((parts.hostname, parts.port), timeout=120)
        key = base64.b64encode(os.urandom(16)).decode()
        heads = {"Host": parts.netloc, "Upgrade": "websocket", "Connection": "Upgrade",
                 "Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13"}  # fmt: skip
        lines = [f"GET {parts.path} HTTP/1.1", *(f"{name}: {text}" for name, text in heads.items())]
        self.stream.sendall("\r\n".join([*lines, "", ""]).encode())
        self.file = self.stream.makefile("rb")
        status = self.file.readline()
        if b" 101 " not in status:
            raise ConnectionError(status.decode())
        while self.file.readline().strip():
            pass

    def send(self, text: str) -> None:
        """Send a text in one frame, masked as clients have to."""
        data, mask = text.encode(), os.urandom(4)
        size = len(data)
        code, form = (size, "") if size < 126 else (126, "H") if size < 1 << 16 else (127, "Q")
        head = struct.pack(f">BB{form}", 128 + TEXT, 128 + code, *([size] if form else []))
        whole = (mask * (size // 4 + 1))[:size]
        mixed = int.from_bytes(data) ^ int.from_bytes(whole)
        self.stream.sendall(head + mask + mixed.to_bytes(size))

    def receive(self) -> str:
        """Return the next text."""
        parts = []
        while True:
            first, size = self.file.read(2)
            if size >= 126:
                size = int.from_bytes(self.file.read(2 if size == 126 else 8))
            data = self.file.read(size)
            if first & 15 == CLOSES:
                raise ConnectionError("the browser ended")
            if first & 15 <= TEXT:
                parts.append(data)
                if first & 128:
                    return b"".join(parts).decode()

    def close(self) -> None:
        """End it."""
        self.file.close()
        self.stream.close()


class Firefox:
    """A Firefox with one page, and what its console said."""

    def __init__(self, folder: Path, width: int = 1000, height: int = 900) -> None:
        if FIREFOX is None:
            raise FileNotFoundError("no Firefox on this machine")
        profile = folder / "profile"
        profile.mkdir()
        self.process = subprocess.Popen(
            [FIREFOX, "--headless", "--no-remote", "--profile", str(profile),
             "--remote-debugging-port=0"],
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "HOME": str(folder), "MOZ_HEADLESS": "1"},
        )  # fmt: skip
        told = profile / "WebDriverBiDiServer.json"  # written when it listens
        while not (told.exists() and told.read_text(encoding="utf-8").endswith("}")):
            if self.process.poll() is not None:
                raise ConnectionError("Firefox did not start")
            time.sleep(0.05)
        where = json.loads(told.read_text(encoding="utf-8"))
        self.socket = Socket(f"ws://{where['ws_host']}:{where['ws_port']}/session")
        self.count, self.said = 0, list[str]()
        found = self.call("session.new", capabilities={})["capabilities"]
        self.version = f"Firefox {found['browserVersion']}"
        self.call("session.subscribe", events=["log.entryAdded"])
        self.context = self.call("browsingContext.getTree")["contexts"][0]["context"]
        viewport = {"width": width, "height": height}
        self.call("browsingContext.setViewport", context=self.context, viewport=viewport)
        self.mouse, self.keyboard = Mouse(self), Keyboard(self)

    def call(self, method: str, **params: Any) -> Any:
        """Send a command and wait for its answer; messages of the console are kept."""
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": params}))
        while True:
            answer = json.loads(self.socket.receive())
            if answer.get("method") == "log.entryAdded":
                self.said.append(str(answer["params"].get("text")))
            if answer.get("id") == self.count:
                if answer["type"] == "error":
                    raise RuntimeError(answer["message"])
                return answer["result"]

    def opens(self, file: Path) -> None:
        """Open a page, and wait until it is there."""
        self.call(
            "browsingContext.navigate", context=self.context, url=f"file://{file}", wait="complete"
        )
        self.evaluate("mechdae.ready")

    def asks(self, expression: str) -> Any:
        """Return the value of an expression that gives JSON."""
        found = self.call(
            "script.evaluate",
            expression=expression,
            target={"context": self.context},
            awaitPromise=True,
        )
        if found["type"] != "success":
            raise RuntimeError(found["exceptionDetails"]["text"])
        return json.loads(found["result"]["value"])

    def close(self) -> None:
        """End it."""
        self.socket.close()
        self.process.terminate()
        self.process.wait(30)

    # -- what playwright's pages can, as far as the tests' gestures need it

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression."""
        return self.asks(f"(async () => JSON.stringify((await ({expression})) ?? null))()")

    def until(self, condition: str) -> None:
        """Wait for a condition, from frame to frame."""
        for _ in range(400):
            if self.evaluate(condition):
                return
            self.evaluate("new Promise((done) => requestAnimationFrame(() => done(0)))")
        raise AssertionError(condition)

    def locator(self, selector: str) -> Locator:
        """Return the first element of a selector."""
        return Locator(self, selector)

    def acts(self, kind: str, *actions: dict[str, Any]) -> None:
        """Let the pointer, the wheel or the keys do something."""
        source = {"type": kind, "id": kind, "actions": list(actions)}
        self.call("input.performActions", context=self.context, actions=[source])


class Locator:
    """An element of a page."""

    def __init__(self, page: Firefox, selector: str) -> None:
        self.page, self.selector = page, selector

    def bounding_box(self) -> dict[str, float]:
        """Return where it is."""
        box: dict[str, float] = self.page.asks(BOX % json.dumps(self.selector))
        return box

    def click(self) -> None:
        """Click its middle."""
        box = self.bounding_box()
        self.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)

    def inner_text(self) -> str:
        """Return its text."""
        text: str = self.page.evaluate(
            f"document.querySelector({json.dumps(self.selector)}).innerText"
        )
        return text


class Mouse:
    """The pointer and the wheel."""

    def __init__(self, page: Firefox) -> None:
        self.page, self.place = page, (0.0, 0.0)

    def move(self, x: float, y: float, steps: int = 1) -> None:
        """Move to a place of the page, in as many steps."""
        u, v = self.place
        shares = [(k + 1) / steps for k in range(steps)]
        places = [(u + share * (x - u), v + share * (y - v)) for share in shares]
        self.page.acts(
            "pointer", *({"type": "pointerMove", "x": a, "y": b, "duration": 0} for a, b in places)
        )
        self.place = (x, y)

    def down(self) -> None:
        """Press."""
        self.page.acts("pointer", {"type": "pointerDown", "button": 0})

    def up(self) -> None:
        """Release."""
        self.page.acts("pointer", {"type": "pointerUp", "button": 0})

    def click(self, x: float, y: float) -> None:
        """Press and release at a place."""
        self.move(x, y)
        self.down()
        self.up()

    def wheel(self, x: float, y: float) -> None:
        """Turn the wheel where the pointer is."""
        u, v = (round(value) for value in self.place)
        way = {"x": u, "y": v, "deltaX": round(x), "deltaY": round(y)}
        self.page.acts("wheel", {"type": "scroll", **way})


class Keyboard:
    """The keys."""

    def __init__(self, page: Firefox) -> None:
        self.page = page

    def press(self, keys: str) -> None:
        """Press keys together, as "Control+z", and let them go."""
        values = [KEYS.get(name, name) for name in keys.split("+")]
        downs = [{"type": "keyDown", "value": value} for value in values]
        ups = [{"type": "keyUp", "value": value} for value in reversed(values)]
        self.page.acts("key", *downs, *ups)
