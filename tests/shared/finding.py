"""The editor's search for linkages, driven in Chromium: what it finds and what it costs."""

from __future__ import annotations

import numpy as np

from mechdae.parts.page.editor import editor
from tests.shared.browser import loaded, until

FOUND = """mechdae.finder.found.map((own) => ({ class: own.facts.class, angle: own.facts.angle,
  error: own.error, miss: own.miss, good: own.good, order: own.order, branch: own.facts.branch,
  way: own.way ? Array.from(own.way) : [] }))"""
SEEK = """(curve) => { mechdae.finder.task.curve = curve; mechdae.finder.changed();
  mechdae.finder.search(); }"""


class Finding:
    """The editor with its tool, in one context of a browser."""

    def __init__(self, browser, folder):
        context = browser.new_context(viewport={"width": 1100, "height": 1000})
        self.page = context.new_page()
        self.said: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", self._asked)
        loaded(self.page, editor().save(folder / "editor.html"))
        self.page.locator("[data-tool=find]").click()
        self.session = context.new_cdp_session(self.page)
        self.session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def _asked(self, request):
        if not request.url.startswith(("file:", "blob:", "data:")):
            self.said.append(request.url)

    def again(self):
        """Begin with an empty drawing."""
        self.page.reload()
        self.page.evaluate("mechdae.ready")
        self.page.locator("[data-tool=find]").click()

    def seconds(self):
        """Return the processor time of the page's thread."""
        values = self.session.send("Performance.getMetrics")["metrics"]
        return next(own["value"] for own in values if own["name"] == "TaskDuration")

    def choose(self, name):
        self.page.get_by_role("button", name=name, exact=True).click()

    def atlas(self):
        """Wait for the atlas; its processor seconds."""
        begun = self.seconds()
        self.choose("Curve")
        until(self.page, "mechdae.finder.atlas.ready")
        return self.seconds() - begun

    def curve(self, curve, whole=True):
        """Return what is found for a closed curve (n,), and the seconds of the first three.

        Without `whole` the rest is not waited for.
        """
        begun = self.seconds()
        self.page.evaluate(SEEK, np.stack([curve.real, curve.imag], axis=1).tolist())
        self.until("mechdae.finder.took !== null")
        seconds = self.seconds() - begun
        return (self.waited() if whole else self.found()), seconds

    def waited(self):
        self.until("!mechdae.finder.busy")
        return self.found()

    def until(self, condition):
        """Wait as long as it takes, but not for a search that has failed."""
        while not self.page.evaluate(condition):
            assert self.said == []
            self.page.wait_for_timeout(20)

    def found(self):
        found = self.page.evaluate(FOUND)
        for own in found:
            own["way"] = np.array(own["way"]).reshape(-1, 2) @ [1, 1j]
        return found

    def at(self, x, y):
        """Return the pixel of a place in metres."""
        box = self.page.locator("#diagram").bounding_box()
        u, v = self.page.evaluate(f"mechdae.screen([{x}, {y}])")
        return box["x"] + u, box["y"] + v
