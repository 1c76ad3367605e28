"""What a page draws of a pose is what `plot` draws: the same primitives, places and names."""

from __future__ import annotations

import numpy as np
import pytest

from tests.shared.browser import CHROMIUM
from tests.shared.page_shapes import SHAPES, Pages, compare_names, compare_primitives

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

CASES = [  # all others are compared by `test_all_pages.py`
    ("four-bar-crank-rocker", "turn"),
    ("cam-roller-follower", "turn"),
    ("planetary-gear-train", "turn"),
]
LOADED = [("seven-link-forces", "stroke"), ("slider-crank-friction", "cycle")]


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    return Pages(tmp_path_factory.mktemp("pages"), CASES + LOADED)


@pytest.mark.parametrize("name", [name for name, _ in CASES])
def test_primitives_are_those_of_plot(name, opened, pages):
    compare_primitives(opened, pages, name)


@pytest.mark.parametrize("name", [name for name, _ in CASES])
def test_names_are_those_of_plot(name, opened, pages):
    compare_names(opened, pages, name)


@pytest.mark.parametrize(
    ("name", "bodies", "degrees"),
    [
        ("seven-link-forces", {"press": "slider", "drag": "rocker"}, (40, 58, -41)),
        ("slider-crank-friction", {"work": "slider"}, (60, 179, 181, 300)),
    ],
)
def test_arrows_of_resistances_have_the_sense_of_the_force(name, bodies, degrees, opened, pages):
    """A force to the right points right, a positive torque turns counterclockwise."""
    browser_page = opened(name)
    _, result = pages.solved[name]
    angles = np.rad2deg(result.drivers["crank.angle"].position)
    senses = {load: set() for load in bodies}
    for degree in degrees:
        pose = int(np.abs(angles - degree).argmin())
        assert browser_page.evaluate(f"mechdae.set({{'crank.angle': {np.deg2rad(angles[pose])}}})")
        shapes = browser_page.evaluate(SHAPES)
        for load, body in bodies.items():
            fx, _, moment = result.loads[load][body][pose]
            shaft = next(shape for shape in shapes if shape["id"] == f"load-{load}")["points"]
            steps = np.diff(np.array(shaft) * (1, -1), axis=0)
            bend = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
            seen, true = (steps[0, 0], fx) if len(steps) == 1 else (bend.sum(), moment)
            assert np.sign(seen) == np.sign(true) != 0, (load, degree)
            senses[load].add(np.sign(true))
    assert all(signs == {-1.0, 1.0} for signs in senses.values())


def test_names_of_dimensions_are_clear_of_pins(opened):
    """Radii of pins are shorter than their names."""
    gaps = """() => {
      const middles = (all) => [...document.querySelectorAll(all)].map((own) => {
        const { x, y, width, height } = own.getBoundingClientRect();
        return [x + width / 2, y + height / 2];
      });
      const pins = middles('#diagram [data-id$=-pin] circle');
      return middles('.dimension:not([display=none]) .name').map(([x, y]) =>
        Math.min(...pins.map(([u, v]) => Math.hypot(x - u, y - v))));
    }"""
    found = opened("slider-crank-friction").evaluate(gaps)
    assert len(found) == 4  # r, l and two radii that are large enough to be drawn
    assert min(found) > 15
