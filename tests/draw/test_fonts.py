"""Sizes of texts by the table of letters, against the outlines that are drawn."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.textpath import TextPath

from mechdae.draw import style
from mechdae.draw.fonts import Font, font, ink, width_of

FACES = (font(13.0), font(13.0, style="italic"), font(9.0, style.NOTE_FONT))
TEXTS = (
    "A",
    "B3",
    "12",
    "Slider-crank",
    "crank.angle = 60°",
    "100 mm",
    "ω2",
    "мм",
    "Ось",
    "$x",
    "q",
)


def drawn(text: str, font: Font) -> tuple[np.ndarray, np.ndarray]:
    box = TextPath((0.0, 0.0), text.replace("$", r"\$"), prop=font.properties).get_extents()
    return np.array([box.x0, box.y0]), np.array([box.x1, box.y1])


@pytest.mark.parametrize("face", FACES, ids=lambda face: f"{face.families[0]} {face.style}")
@pytest.mark.parametrize("text", TEXTS)
def test_a_text_is_as_large_as_its_outlines(text: str, face: Font) -> None:
    """But for kerning, which draws some pairs of letters nearer to each other."""
    low, high = ink(text.replace("$", r"\$"), face)
    least, most = drawn(text, face)
    kerning = 0.02 * face.size * (len(text) - 1)
    assert low == pytest.approx(least, abs=1e-3 * face.size)
    assert high[1] == pytest.approx(most[1], abs=1e-3 * face.size)
    assert most[0] - 1e-3 * face.size <= high[0] <= most[0] + kerning + 1e-3 * face.size


def test_letters_without_a_row_are_measured_by_their_outlines() -> None:
    low, high = ink("漢", FACES[2])
    assert (high > low).all()
    assert width_of(r"$a^n_{A3}$", FACES[0]) < width_of("a^n_{A3}", FACES[0])


def test_an_index_stands_behind_and_below() -> None:
    alone, with_index = ink("A", FACES[1]), ink("A", FACES[1], "2")
    assert with_index[1][0] > alone[1][0]
    assert with_index[0][1] < alone[0][1]
