"""Graphs and plans in Russian: what the drawing writes, and not what the user has named."""

from __future__ import annotations

import re

import pytest
from matplotlib.text import Text

import mechdae as md
from mechdae.draw.translated import in_russian
from mechdae.draw.words import unit_in_russian
from mechdae.errors import UnknownName


@pytest.mark.parametrize(
    ("english", "russian"),
    [
        ("angle [deg]", "угол [°]"),
        ("effort [N m]", "усилие [Н·м]"),
        ("crank.angle [deg]", "crank.angle [°]"),
        ("[deg]", "[°]"),
        ("turn  ·  361 poses", "turn  ·  положений: 361"),
        ("a = 1°  ·  turn  ·  pose 2 of 3", "a = 1°  ·  turn  ·  положение 2 из 3"),
        ("crank.angle, no friction", "crank.angle, без трения"),
        ("slide, mean 5.91 W", "slide, сред. 5,91 Вт"),
        ("limit −76.3°, 60.9°", "предел −76,3°, 60,9°"),
        (r"$\mu_a$ = 2 (m/s$^2$)/mm", r"$\mu_a$ = 2 (м/с$^2$)/мм"),
        ("Forces on II.2 RRP(2,3)", "План сил, II.2 RRP(2,3)"),
        ("work = 1 kN", "work = 1 кН"),
        ("54.9 at 24.15°", "54,9 при 24,15°"),
        ("rod", "rod"),
        ("slide", "slide"),
        ("slide [m]", "перемещение [м]"),
        ("II.2 RRP(2,3)", "II.2 RRP(2,3)"),
    ],
)
def test_words(english: str, russian: str) -> None:
    assert in_russian(english) == russian


@pytest.mark.parametrize("kind", ["curves", "losses", "plans"])
def test_no_english_is_left(kind: str) -> None:
    """All words of the pictures are Russian or names of the file."""
    result = md.solve("slider-crank-friction", "cycle")
    axes = md.plot(result, kind, lang="ru")
    names = {"slider", "crank", "cycle", "angle", "slide", "rod", "work", "RRP", "II"}
    names |= set(re.findall(r"[A-Za-z]{2,}", f"{result.title} {result.problem}"))
    axes.figure.canvas.draw()
    for text in axes.figure.findobj(Text):
        assert not re.search(r"\d\.\d", text.get_text())
        assert isinstance(text, Text)
        plain = re.sub(r"\$.*?\$", "", text.get_text())
        words = set(re.findall(r"[A-Za-z]{2,}", plain))
        assert words <= names, text.get_text()


def test_another_language() -> None:
    result = md.solve("slider-crank", "turn")
    with pytest.raises(UnknownName, match="language"):
        md.plot(result, "curves", lang="de")


@pytest.mark.parametrize(
    ("unit", "said"),
    [("N m", "Н·м"), ("kg m2", "кг·м²"), ("kg/m", "кг/м"), ("(N s/m)", "(Н·с/м)"), ("1/m²", "1/м²"),
     ("(m/s$^2$)", "(м/с$^2$)"), ("5 mm", "5 mm"), ("m is", "m is")],
)  # fmt: skip
def test_products_and_quotients_of_units_are_translated(unit, said):
    assert unit_in_russian(unit) == said
