"""The words of explanations, in each language from one table."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from mechdae.draw.words import unit_in_russian
from mechdae.errors import UnknownName

EN = {
    "pose": "pose {0} of {1}",
    "bound": "error bound",
    "m": "m",
    "rad": "rad",
    "formula": "structural formula",
    "status": "status",
    "assumes": "assumes",
    "drivers": "drivers",
    "mechanism": "The mechanism and its pose",
    "group": "Group {0}",
    "links": "links",
    "ground": "ground",
    "joints": "joints",
    "joint between": "{0}: {1}, {2} - {3}",
    "known": "known",
    "sought": "sought",
    "places of": "places of {0}",
    "motion of": "motion of {0}",
    "points": "points",
    "under": "{0}, the point of {1} that is at {2}",
    "positions": "Positions",
    "velocities": "Velocities",
    "accelerations": "Accelerations",
    "no relation": "Nothing in this group has a vector equation of its own.",
    "solved": "Solved values:",
    "term": "vector",
    "size": "size",
    "angle": "direction",
    "line": "line of action",
    "along": "along {0}",
    "across": "square to {0}",
    "from to": "from {0} to {1}",
    "turned": "{0} turned by 90°, to the side of ω",
    "given": "known",
    "forces": "Forces, from the last group to the driver",
    "forces of": "Forces on group {0}",
    "link": "Link {0}, {1}",
    "acts": "force",
    "at": "at",
    "moment about": "M about {0}",
    "moments about": "Forces and moments about {0}:",
    "sum": "sum",
    "in sum": "The forces on the link are in balance, Φ its force of inertia (d'Alembert):",
    "not unique": (
        "The equations do not determine the reactions of {0}: constraints are superfluous, only "
        "sums of these reactions are known. So there is no sum of forces here."
    ),
    "unloaded": "No force acts on it.",
    "reactions": "Reactions of its joints:",
    "reaction": "joint {0}",
    "reaction is": "|R| = {0} at {1}, acts on {2}",
    "reaction in space": "|R| = {0}, |M| = {1} about its point, acts on {2}",
    "spins freely": (
        "This link has a mass and no orientation that is known: it is a point, or spins freely "
        "between ball joints. So there is no sum of forces here."
    ),
    "pin friction": "; friction torque {0} against the relative rotation of {1}, loses {2}",
    "slide friction": "; normal force {0}, friction {1} along the guide "
    "against the sliding of {2}, loses {3}",
    "other friction": "; loses {0}",
    "effort": "The driver",
    "effort is": "{0} at {1} is what the balance of its link asks for.",
    "check": "The check that closes it",
    "power": (
        "The powers of drivers, loads, inertia and friction add up to nothing. "
        "None of the reactions is in this sum."
    ),
    "centre": "centre of mass",
    "couple": "couple",
    "power letter": "P",
    "N drive": "drivers",
    "N loads": "loads",
    "N inertia": "inertia",
    "N loss": "friction",
}
RU = {
    "pose": "положение {0} из {1}",
    "bound": "граница погрешности",
    "m": "м",
    "rad": "рад",
    "formula": "структурная формула",
    "status": "состояние",
    "assumes": "допущение",
    "drivers": "ведущие координаты",
    "mechanism": "Механизм и его положение",
    "group": "Группа {0}",
    "links": "звенья",
    "ground": "стойка",
    "joints": "кинематические пары",
    "joint between": "{0}: {1}, {2} - {3}",
    "known": "известно",
    "sought": "искомое",
    "places of": "положения {0}",
    "motion of": "движение {0}",
    "points": "точки",
    "under": "{0} - точка звена {1}, совпадающая с {2}",
    "positions": "Положения",
    "velocities": "Скорости",
    "accelerations": "Ускорения",
    "no relation": "В этой группе нет собственных векторных уравнений.",
    "solved": "Найденные значения:",
    "term": "вектор",
    "size": "модуль",
    "angle": "направление",
    "line": "линия действия",
    "along": "∥ {0}",
    "across": "⊥ {0}",
    "from to": "от {0} к {1}",
    "turned": "{0}, повёрнут на 90° в сторону ω",
    "given": "известно",
    "forces": "Силы, от последней группы к ведущему звену",
    "forces of": "Силы, действующие на группу {0}",
    "link": "Звено {0}, {1}",
    "acts": "сила",
    "at": "точка",
    "moment about": "M относительно {0}",
    "moments about": "Силы и моменты относительно {0}:",
    "sum": "сумма",
    "in sum": "Силы, действующие на звено, уравновешены вместе с силой инерции Φ (Даламбер):",
    "not unique": (
        "Реакции в парах {0} уравнениями не определяются: есть избыточные связи, известны только "
        "их суммы. Поэтому суммы сил здесь нет."
    ),
    "unloaded": "Силы на него не действуют.",
    "reactions": "Реакции в кинематических парах:",
    "reaction": "пара {0}",
    "reaction is": "|R| = {0} под углом {1}, действует на {2}",
    "reaction in space": "|R| = {0}, |M| = {1} относительно её точки, действует на {2}",
    "spins freely": (
        "Это звено с массой свободно вращается между шаровыми парами: его поворот неизвестен, "
        "поэтому суммы сил здесь нет."
    ),
    "pin friction": "; момент трения {0} против относительного вращения {1}, потери {2}",
    "slide friction": "; нормальная сила {0}, трение {1} вдоль направляющей "
    "против скольжения {2}, потери {3}",
    "other friction": "; потери {0}",
    "effort": "Ведущее звено",
    "effort is": "{0} на {1}: этого требует равновесие звена.",
    "check": "Проверка",
    "power": (
        "Мощности двигателя, нагрузок, сил инерции и трения в сумме дают нуль. "
        "Реакций в этой сумме нет."
    ),
    "centre": "центр масс",
    "couple": "пара сил",
    "power letter": "N",
    "N drive": "двигатель",
    "N loads": "нагрузки",
    "N inertia": "инерция",
    "N loss": "трение",
    "revolute": "вращательная",
    "prismatic": "поступательная",
    "weld": "жёсткая",
    "pin-in-slot": "палец в пазу",
    "gear": "зубчатая",
    "rack": "реечная",
    "belt": "ременная",
    "cylindrical": "цилиндрическая",
    "universal": "карданная",
    "spherical": "шаровая",
    "planar": "плоскостная",
    "screw": "винтовая",
    "distance": "стержень",
    "vector": "вектор",
}
TABLE: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {"en": MappingProxyType(EN), "ru": MappingProxyType(RU)}
)


class Said:
    """The words of one language, of explanations or of another table by language.

    Raises
    ------
    UnknownName
        There is no such language.
    """

    def __init__(self, lang: str, words: Mapping[str, Mapping[str, str]] = TABLE) -> None:
        if lang not in words:
            raise UnknownName("language", lang, list(words))
        self.lang, self._table = lang, words[lang]

    def __call__(self, word: str, *values: object) -> str:
        """Return a phrase with values in it."""
        return self._table[word].format(*values)

    def unit(self, text: str) -> str:
        """Return a unit as the language writes it."""
        return unit_in_russian(text) if self.lang == "ru" else text

    def kind(self, name: str) -> str:
        """Return the name of a kind of joint, as the file has it where there is no other."""
        return self._table.get(name, name)
