"""Chromium for tests: where it is, how it is started, how one waits in a page."""

from __future__ import annotations

import shutil

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


def until(page, condition):
    """Wait for a condition; the page's policy lets nobody poll inside of it."""
    for _ in range(200):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(25)
    raise AssertionError(condition)


def loaded(page, file, fragment=""):
    """Open a page or an editor, and wait until it is there."""
    page.goto(f"file://{file}{fragment}")
    page.evaluate("mechdae.ready")


PLANS = """() => [...document.querySelectorAll("#plans .plan")].map((svg) => {
  const sheet = svg.getBoundingClientRect();
  return [...svg.querySelectorAll("text")].map((own) => {
    const { left, right, top, bottom } = own.getBoundingClientRect();
    const box = [left - sheet.left, top - sheet.top, right - sheet.left, bottom - sheet.top];
    return [own.textContent, ...box];
  });
})"""


def covered(page, least=3.0):
    """Return the pairs of texts of the plans shown that lie on each other [px]."""
    found = []
    for texts in page.evaluate(PLANS):
        for k, (name, *box) in enumerate(texts):
            for further, *other in texts[:k]:
                wide, high = (min(box[i + 2], other[i + 2]) - max(box[i], other[i]) for i in (0, 1))
                if wide > least and high > least:
                    found.append((name, further, wide, high))
    return found


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as own:
        opened = own.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


@pytest.fixture
def opened(browser, pages):
    """Open a page; after the test nothing was said and nobody asked."""
    said: list[str] = []
    contexts = []

    def open_page(name, fragment="", **options):
        context = browser.new_context(**{"viewport": {"width": 1100, "height": 800}, **options})
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: said.append(request.url)
                if not request.url.startswith(("file:", "blob:", "data:")) else None)  # fmt: skip
        loaded(page, pages[name], fragment)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert said == []
