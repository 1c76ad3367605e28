"""Labels of motions: their places over all poses, and that they keep off the links."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.animation import animate
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.fonts import ink
from mechdae.draw.labels.steady import MOVES, cheapest_course


def test_no_other_course_is_cheaper():
    rng = np.random.default_rng(3)
    for _ in range(20):
        costs, ways = rng.uniform(0, 60, (5, 4)), rng.uniform(-20, 20, (4, 2))

        def price(picks, costs=costs, ways=ways):
            moves = [np.hypot(*(ways[b] - ways[a])) for a, b in pairwise(picks) if a != b]
            return costs[range(5), picks].sum() + sum(MOVES[0] + MOVES[1] * way for way in moves)

        cost, picks = cheapest_course(costs, ways)
        least = min(price(list(own)) for own in product(range(4), repeat=5))
        assert price(picks.tolist()) == pytest.approx(least, abs=1e-4)
        assert cost == pytest.approx(least, abs=1e-4)


def crosses(low, high, a, b):
    """Return whether the line from a to b comes into a box."""
    shares = np.linspace(0.0, 1.0, 200)[:, None]
    points = a + shares * (b - a)
    return bool(((points > low) & (points < high)).all(axis=1).any())


@pytest.mark.parametrize("name", ["four-bar-crank-rocker", "toggle-press"])
def test_letters_keep_off_links_while_they_move(name):
    """In frames between those in which places were compared, too."""
    result = md.solve(name)
    made = animate(result, frames=48, traces=False, loads=False)
    scene, touched = read_scene(result), 0
    for pose, sheet in zip(made.poses, made.drawn(made.poses), strict=True):
        letters = [own for own in sheet.drawn if str(own.gid).startswith("label-")]
        assert letters
        for own in letters:  # and stay at their points
            place = sheet.at(scene.place(own.gid.removeprefix("label-"), pose))
            assert np.hypot(*(own.points[0] - place)) < 40.0
        boxes = [[own.points[0] + corner for corner in ink(own.text, own.font)] for own in letters]
        bars = [own.points for own in sheet.drawn if str(own.gid).endswith("-bar")]
        lines = [pair for points in bars for pair in pairwise(points)]
        touched += any(crosses(*box, *line) for box in boxes for line in lines)
    assert touched <= 0.07 * len(made.poses)
