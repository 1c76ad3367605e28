"""Diagrams: labels cover nothing; letters of pins and numbers of bodies."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.draw import style
from mechdae.draw.diagram import diagram
from mechdae.draw.diagram.places import places_of, written
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.labels.labels import numbers_of, write_all
from mechdae.draw.labels.obstacles import length_inside
from tests.shared.drawn import (
    SAMPLES,
    five_bar,
    seven_link,
)


@pytest.fixture
def spied(monkeypatch):
    """Sheets and label boxes of the diagrams drawn in a test."""
    seen = []

    def spy(sheet, *rest):
        drawn = (list(sheet.segments), list(sheet.boxes))
        seen.append((sheet, drawn, write_all(sheet, *rest)))
        return seen[-1][2]

    monkeypatch.setattr(diagram, "write_all", spy)
    return seen


def overlap(low, high, other_low, other_high):
    """The common area of each box with each other box, (boxes, others)."""
    shared = np.minimum(high[:, None], other_high) - np.maximum(low[:, None], other_low)
    return np.clip(shared, 0.0, None).prod(axis=-1)


def crossing(segments, low, high):
    """The length of each segment inside each box, (boxes, segments)."""
    k, s = np.indices((len(low), len(segments))).reshape(2, -1)
    start, end = segments[:, 0:2], segments[:, 2:4]
    line = np.hstack([(start + end) / 2, (end - start) / 2]).T[:, s]
    box = np.hstack([(low + high) / 2, (high - low) / 2]).T[:, k]
    return length_inside(line, box).reshape(len(low), len(segments))


@pytest.mark.parametrize("name", SAMPLES)
def test_labels_cover_neither_links_nor_each_other(name, spied):
    md.plot(SAMPLES[name](), ghosts=2)
    ((sheet, (segments, boxes), labels),) = spied
    low = np.array([label[1] for label in labels]) + 0.5
    high = np.array([label[2] for label in labels]) - 0.5
    assert (low > 0).all()
    assert (high < sheet.size).all()
    shared = overlap(low, high, low, high)
    np.fill_diagonal(shared, 0.0)
    assert not shared.any()
    rows = np.array([row for row in segments if row[4] >= style.SOLID])
    assert not crossing(rows, low, high).any()
    rows = np.array(boxes)
    assert not overlap(low, high, rows[:, :2], rows[:, 2:4]).any()


def test_crossing_is_the_length_inside():
    low, high = np.array([[0.0, 0.0]]), np.array([[2.0, 1.0]])
    rows = np.array(
        [[-1, 0.5, 3, 0.5, 1], [1, 0.5, 1, 9, 1], [0, 2, 3, 2, 1], [5, -1, 5, 3, 1]], dtype=float
    )
    np.testing.assert_allclose(crossing(rows, low, high), [[2.0, 0.5, 0.0, 0.0]])


def test_letters_of_shared_pins():
    scene = read_scene(five_bar())
    assert [place.letter for place in places_of(scene, 0)] == ["A", "B", "C", "D"]
    scene = read_scene(seven_link())
    letters = [place.letter for place in places_of(scene, 0)]
    assert letters == ["O", "A", "G", "B", "C", "E", "F"]
    assert written("A12") == ("A", "12")
    assert written("wheel_pin") == ("wheel_pin", "")
    assert written("C1, B12") == ("C₁, B₁₂", "")


def test_numbers_are_the_bodies_own_or_the_next_free():
    bodies = [md.Body("a", {"P": [0, 0]}), md.Body("b", {"P": [0, 0]}, number=1)]
    joints = [md.Revolute("J", "ground.O", "a.P"), md.Revolute("K", "a.P", "b.P")]
    mechanism = md.Mechanism(md.Ground({"O": [0, 0]}), bodies, joints)
    assert numbers_of(mechanism) == {"a": 2, "b": 1}
