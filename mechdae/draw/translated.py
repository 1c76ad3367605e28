"""Graphs and plans in another language: the words that the drawing itself has written."""

from __future__ import annotations

import re
from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import ScalarFormatter

from mechdae.draw.words import Words, table, unit_in_russian

STATES = table("states")
_STATE = "|".join(sorted(STATES, key=len, reverse=True))


_ru = unit_in_russian
Rule = tuple[re.Pattern[str], Callable[[re.Match[str]], str]]
RULES: tuple[Rule, ...] = (
    (re.compile(r"(.*)  ·  (\d+) poses"), lambda m: f"{m[1]}  ·  положений: {m[2]}"),
    (
        re.compile(r"(.*  ·  )pose (\d+) of (\d+)(.*)"),
        lambda m: f"{m[1]}положение {m[2]} из {m[3]}{m[4]}",
    ),
    (re.compile(r"(.*), no friction"), lambda m: f"{m[1]}, без трения"),
    (re.compile(r"([-−\d.e+]+) at (.*)"), lambda m: f"{m[1]} при {m[2]}"),
    (re.compile(r"(\S+) normal"), lambda m: f"{m[1]}, норм."),
    (
        re.compile(r"(.*), mean (\S+) (\S+)"),
        lambda m: f"{m[1]}, сред. {m[2]} {_ru(m[3])}",
    ),
    (re.compile(rf"({_STATE}) (.*)"), lambda m: f"{STATES[m[1]]} {m[2]}"),
    (re.compile(r"Diagram,(.*) m/mm"), lambda m: f"Схема,{m[1]} м/мм"),
    (re.compile(r"(\w+ plan), (.*)"), lambda m: f"{in_russian(m[1])}, {m[2]}"),
    (re.compile(r"class (\w+), order (\d+)"), lambda m: f"класс {m[1]}, порядок {m[2]}"),
    (re.compile(r"Forces on (.*)"), lambda m: f"План сил, {m[1]}"),
    (re.compile(r"(\$\\mu_\w\$ = \S+) (.*)/mm"), lambda m: f"{m[1]} {_ru(m[2])}/мм"),
    (
        re.compile(r"(.*) ?\[(.*)\]"),
        lambda m: f"{_quantity(m[1].strip())} [{_ru(m[2])}]".strip(),
    ),
    (
        re.compile(r"(.* = )?([-−\d.,]+) (\D+)"),
        lambda m: f"{m[1] or ''}{m[2]} {_ru(m[3])}",
    ),
)
"""What is written, whole, and what stands there instead; the first rule that fits is taken."""


def translated(axes: Axes, lang: str) -> Axes:
    """Return axes of graphs or plans with the words of their figure in a language.

    Names that the user has given are left as they are, and so is what no rule knows.

    Raises
    ------
    UnknownName
        There is no such language.
    """
    Words(lang)
    figure = axes.get_figure(root=True)
    if lang == "ru" and isinstance(figure, Figure):
        for text in figure.findobj(Text):
            assert isinstance(text, Text)
            new = in_russian(text.get_text())
            if new != text.get_text() and not str(text.get_gid()).startswith("title"):
                text.set_text(new)
        for axis in (axis for panel in figure.axes for axis in (panel.xaxis, panel.yaxis)):
            if isinstance(axis.get_major_formatter(), ScalarFormatter):
                axis.set_major_formatter(_Comma())
    return axes


class _Comma(ScalarFormatter):
    """Numbers at ticks with a decimal comma."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the number at a tick."""
        return super().__call__(x, pos).replace(".", ",")


def in_russian(text: str) -> str:
    """Return a text of a graph or plan in Russian, with decimal commas, or as it is."""
    whole = table("whole")
    if text in whole:
        return whole[text]
    found = next((words(m) for rule, words in RULES if (m := rule.fullmatch(text))), text)
    return re.sub(r"(?<=\d)\.(?=\d)", ",", found)


def _quantity(text: str) -> str:
    return table("quantities").get(text, text)
