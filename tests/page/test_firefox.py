"""Firefox: a four-bar drawn by mouse events, and a live page with a point that is dragged."""

from __future__ import annotations

import pytest

import mechdae as md
from mechdae.parts.page.editor import editor
from tests.shared import drawing
from tests.shared.firefox import FIREFOX, Firefox


@pytest.mark.slow
@pytest.mark.skipif(FIREFOX is None, reason="no Firefox on this machine")
def test_firefox_draws_and_moves_what_python_solves(tmp_path):
    browser = Firefox(tmp_path)
    try:
        browser.opens(editor().save(tmp_path / "editor.html"))
        drawing.out(browser, 1.6)
        drawing.draw(browser, drawing.COUPLER)
        assert drawing.as_python(browser, tmp_path / "drawn.toml")[0] == 9
        drawn = browser.evaluate("mechdae.toml()")
        browser.keyboard.press("Control+z")
        assert "link2_E_x" not in browser.evaluate("mechdae.toml()")
        browser.keyboard.press("Control+Shift+z")
        assert browser.evaluate("mechdae.toml()") == drawn
        browser.opens(md.page("four-bar-crank-rocker", "turn").save(tmp_path / "page.html"))
        assert browser.evaluate("mechdae.live") is True
        browser.evaluate("mechdae.set({'crank.angle': 1.0})")
        box = browser.locator("[data-id='point-coupler.P']").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        browser.mouse.move(x, y)
        browser.mouse.down()
        browser.mouse.move(x - 30, y - 10, steps=5)
        browser.mouse.up()
        turned = "mechdae.pose().driver['crank.angle']"
        browser.until(f"Math.abs({turned} - 1.0) > 0.01")
        driver = md.Driver("crank.angle", at=(browser.evaluate(turned),), speed=10.0)
        mechanism = md.load("four-bar-crank-rocker").mechanism
        truth = md.solve(mechanism, md.Sweep(driver=driver)).points["coupler.P"]
        shown = browser.evaluate("mechdae.pose().points['coupler.P']")
        for rate in ("position", "velocity", "acceleration"):
            assert shown[rate] == pytest.approx(getattr(truth, rate)[0], rel=1e-11)
        assert browser.said == []
    finally:
        browser.close()
