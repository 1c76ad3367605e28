"""A notebook that is executed and converted: tables, pictures and a live page, without a magic."""

from __future__ import annotations

import base64
import html
import re

import pytest

from tests.shared.browser import ARGUMENTS, CHROMIUM

nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")
nbconvert = pytest.importorskip("nbconvert", reason="nbconvert is not installed")
pytest.importorskip("ipykernel", reason="ipykernel is not installed")
pytest.importorskip("pandas", reason="pandas is not installed")
pytestmark = pytest.mark.filterwarnings("default")  # of the notebook's own packages

CELLS = [
    "import mechdae as md\nresult = md.solve('slider-crank', 'turn')\nresult",
    "md.plot(result, 'curves')",
    "import matplotlib\nmatplotlib.use('svg')\nmd.plot(result)",
    "md.page(result)",
    "result.frame().iloc[[0, 90]]",
    "md.load('slider-crank')",
    "[*result.points._ipython_key_completions_()]",
]


@pytest.fixture(scope="module")
def executed():
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    book.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3"}
    nbclient.NotebookClient(book, timeout=120).execute()
    return book


def shown(book, k):
    """Return what the last line of a cell shows, by type."""
    return book.cells[k].outputs[-1]["data"]


def test_a_result_shows_a_table_and_its_picture(executed):
    data = shown(executed, 0)
    assert "<table>" in data["text/html"]
    assert "crank.angle [deg]" in data["text/html"]
    picture = re.search(r'src="data:image/svg\+xml;base64,([^"]*)"', data["text/html"])
    assert picture is not None
    assert b"<svg" in base64.b64decode(picture[1])
    assert data["text/plain"].startswith("<SweepResult slider-crank / turn: ")


@pytest.mark.parametrize("k", [1, 2])
def test_a_plot_shows_its_figure(executed, k):
    assert base64.b64decode(shown(executed, k)["image/png"]).startswith(b"\x89PNG")


def test_a_page_is_live_in_the_converted_notebook(executed):
    text, _ = nbconvert.HTMLExporter().from_notebook_node(executed)
    frame = re.search(r'<iframe[^>]* srcdoc="([^"]*)"', text)
    assert frame is not None
    page = html.unescape(frame[1])
    assert '<script type="application/json" id="mechdae">' in page
    assert '"live":true' in page
    assert page.rstrip().endswith("</html>")


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_the_page_works_without_a_kernel(executed, tmp_path):
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    text, _ = nbconvert.HTMLExporter().from_notebook_node(executed)
    file = tmp_path / "notebook.html"
    file.write_text(text, encoding="utf-8")
    with playwright.sync_playwright() as own:
        browser = own.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        page = browser.new_page()
        page.route(re.compile("^https?:"), lambda route: route.abort())
        page.goto(f"file://{file}")
        frame = page.frames[-1]
        frame.evaluate("mechdae.ready")
        assert frame.evaluate("mechdae.live") is True
        assert frame.evaluate("mechdae.set({'crank.angle': 0.5}) && mechdae.pose().status") == "ok"
        browser.close()


def test_a_frame_has_the_columns_of_the_table(executed):
    text = shown(executed, 4)["text/plain"]
    assert "crank.angle.position [rad]" in text


def test_names_complete(executed):
    assert "'slider.C'" in shown(executed, 6)["text/plain"]


def test_a_problem_is_a_screen(executed):
    assert "joints\n" in shown(executed, 5)["text/html"]
