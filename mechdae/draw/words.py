"""The words of pictures, in each language from one table."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

from mechdae.errors import UnknownName

UNITS = {
    "deg": "°", "rad": "рад", "m": "м", "mm": "мм", "km": "км", "µm": "мкм", "s": "с", "N": "Н",
    "kN": "кН", "MN": "МН", "mN": "мН", "N m": "Н·м", "kN m": "кН·м", "N mm": "Н·мм", "W": "Вт",
    "1/s": "1/с", "1/m": "1/м", "1/m²": "1/м²", "kg m2": "кг·м²", "kg cm2": "кг·см²",
    "cm": "см", "g": "г", "kW": "кВт",
    "MW": "МВт", "mW": "мВт", "J": "Дж", "kJ": "кДж", "kg": "кг", "rpm": "об/мин",
}  # fmt: skip
"""Units in Russian."""

TABLE: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "en": MappingProxyType(
            {
                "absent": "not in the scene",
                "dashed": "dashed, not in the scene",
                "unasked": "not in the result",
                "undrawn": "not drawn",
                "pose": "pose",
                "pose of": "pose {0} of {1}",
                "mode of": "mode {0}, {1} of {2}",
                "ok": "ok",
                "limit": "limit",
                "unassembled": "unassembled",
                "singular": "singular",
                "ambiguous": "ambiguous",
                "held": "held",
                "seen from": "seen from {0}°, {1}°",
                "fixed axode": "fixed axode",
                "moving axode": "moving axode dashed",
                "front view": "front view",
                "top view": "top view",
                "left view": "left view",
                "shape of": "shape {0} of {1}",
                "Hz": "Hz",
                "damping": "damping {0}",
                "rate": "rate {0} 1/s",
                "enlarged": "enlarged",
                "gap": "{0} open by {1}",
                "does not close": "does not close: {0}",
                "too short": "too short: {0}",
                "too long": "too long: {0}",
                "s": "s",
                "m": "m",
                "mm": "mm",
                "km": "km",
                "µm": "µm",
                "N": "N",
                "N m": "N m",
                "point": ".",
                "design of": "design {0} of {1}",
                "objective": "objective",
                "objective is": "objective {0}",
                "objective line": "largest deviation / stroke",
                "objective largest": "largest error [{0}]",
                "objective mean": "mean squared error [{0}]",
                "objective sum": "sum of squared errors [{0}]",
                "transmission at least": "transmission ≥ {0}°",
                "largest at a target": "largest error {0} at {1}",
                "largest error": "largest error {0}",
                "errors enlarged": "errors × {0}",
                "target": "target",
                "path of": "path of {0}",
                "swing": "swing {0}°",
                "time ratio": "time ratio {0}",
                "wanted": "wanted",
                "of the design": "of the design",
                "error": "error",
                "deviation": "deviation",
                "along the line": "along the line",
                "starts": "convergence of {0} starts",
                "start": "start",
                "met": "met all constraints: {0}",
                "not met": "no optimum: {0}",
                "best so far": "best so far",
                "census": "census of {0} starts: {1} distinct optima, {2} rejected",
                "census solutions": "{0} solutions, {1} of them rejected",
                "hits": "starts that ended there",
                "hits of": "{0} starts",
                "hit of": "1 start",
                "design": "design {0}",
                "rejected": "rejected",
                "not reported": "not reported",
                "more": "{0} more optima",
                "failed": "no optimum",
                "none found": "no design found",
                "front of": "front of {0} points",
                "hypervolume": "hypervolume {0}",
                "compared": "{0} designs compared",
                "compared one": "one design",
                "error at": "error at the target",
                "crank-rocker": "crank-rocker",
                "drag-link": "drag-link",
                "any": "any class",
                "Infeasible_Problem_Detected": "ended where no design near meets all limits",
                "Maximum_Iterations_Exceeded": "iterations used up",
                "Restoration_Failed": "no way back to the limits found",
                "rad": "rad",
                "1": "1",
            }
        ),
        "ru": MappingProxyType(
            {
                "absent": "вне сцены",
                "dashed": "штрихами, вне сцены",
                "unasked": "нет в результате",
                "undrawn": "не показаны",
                "pose": "положение",
                "pose of": "положение {0} из {1}",
                "mode of": "сборка {0}, {1} из {2}",
                "ok": "верно",
                "limit": "предельное",
                "unassembled": "не собирается",
                "singular": "особое",
                "ambiguous": "неоднозначное",
                "held": "закреплено",
                "seen from": "вид с {0}°, {1}°",
                "fixed axode": "неподвижный аксоид",
                "moving axode": "подвижный аксоид штрихами",
                "front view": "вид спереди",
                "top view": "вид сверху",
                "left view": "вид слева",
                "shape of": "форма {0} из {1}",
                "Hz": "Гц",
                "damping": "затухание {0}",
                "rate": "скорость {0} 1/с",
                "enlarged": "увеличено",
                "gap": "{0}: зазор {1}",
                "does not close": "не собирается: {0}",
                "too short": "слишком коротко: {0}",
                "too long": "слишком длинно: {0}",
                "s": "с",
                "m": "м",
                "mm": "мм",
                "km": "км",
                "µm": "мкм",
                "N": "Н",
                "N m": "Н·м",
                "point": ",",
                "design of": "вариант {0} из {1}",
                "objective": "целевая функция",
                "objective is": "целевая функция {0}",
                "objective line": "наибольшее отклонение / ход",
                "objective largest": "наибольшая ошибка [{0}]",
                "objective mean": "средний квадрат ошибки [{0}]",
                "objective sum": "сумма квадратов ошибок [{0}]",
                "transmission at least": "угол передачи ≥ {0}°",
                "largest at a target": "наибольшая ошибка {0} в {1}",
                "largest error": "наибольшая ошибка {0}",
                "errors enlarged": "ошибки × {0}",
                "target": "заданная точка",
                "path of": "траектория {0}",
                "swing": "размах {0}°",
                "time ratio": "коэффициент хода {0}",
                "wanted": "задано",
                "of the design": "получено",
                "error": "ошибка",
                "deviation": "отклонение",
                "along the line": "вдоль прямой",
                "starts": "сходимость, пусков: {0}",
                "start": "пуск",
                "met": "все ограничения выполнены: {0}",
                "not met": "нет оптимума: {0}",
                "best so far": "лучшее к этому пуску",
                "census": "перепись, пусков: {0}; оптимумов: {1}; отклонено: {2}",
                "census solutions": "решений: {0}, из них отклонено: {1}",
                "hits": "число пусков, пришедших сюда",
                "hits of": "пусков: {0}",
                "hit of": "пусков: 1",
                "design": "вариант {0}",
                "rejected": "отклонён",
                "not reported": "не показан",
                "more": "ещё оптимумов: {0}",
                "failed": "нет оптимума",
                "none found": "вариантов не найдено",
                "front of": "фронт, точек: {0}",
                "hypervolume": "гиперобъём {0}",
                "compared": "сравнение вариантов: {0}",
                "compared one": "один вариант",
                "error at": "ошибка в заданной точке",
                "crank-rocker": "кривошипно-коромысловый",
                "drag-link": "двухкривошипный",
                "any": "любой класс",
                "Infeasible_Problem_Detected": "вблизи нет варианта в пределах ограничений",
                "Maximum_Iterations_Exceeded": "исчерпано число итераций",
                "Restoration_Failed": "не удалось вернуться к ограничениям",
                "rad": "рад",
                "1": "1",
            }
        ),
    }
)
"""Language -> key -> what is written. Names that the user gave stay as they are."""
PREFIXES = {
    "en": ("n", "µ", "m", "", "k", "M", "G"),
    "ru": ("н", "мк", "м", "", "к", "М", "Г"),
}


class Words:
    """The words of one language.

    Parameters
    ----------
    lang
        "en" or "ru".

    Raises
    ------
    UnknownName
        Another language.
    """

    def __init__(self, lang: str = "en") -> None:
        if lang not in TABLE:
            raise UnknownName("language", str(lang), list(TABLE))
        self.lang = lang

    def __call__(self, key: str, *values: object) -> str:
        """Return what is written for a key, with values put in."""
        return TABLE[self.lang][key].format(*values)

    def status(self, status: str) -> str:
        """Return the word for the status of a pose."""
        return TABLE[self.lang].get(status, status)

    def number(self, value: float, digits: int = 6) -> str:
        """Return a number of so many significant digits with the language's decimal mark."""
        text = f"{value:.{digits}g}".replace("-", "\N{MINUS SIGN}")
        return text.replace(".", TABLE[self.lang]["point"])

    def amount(self, value: float, unit: str) -> str:
        """Return a quantity with three significant digits and a prefix, such as ``1.2 kN``."""
        step = 0
        while abs(value) >= 999.5 * 1000.0**step and step < 3:
            step += 1
        while 0 < abs(value) < 0.9995 * 1000.0**step and step > -3:
            step -= 1
        prefix = PREFIXES[self.lang][step + 3]
        return f"{self.number(value / 1000.0**step, 3)} {prefix}{TABLE[self.lang][unit]}"


ENGLISH = Words()


def unit_in_russian(text: str) -> str:
    """Return a unit in Russian, or as it is: ``(m/s$^2$)`` is ``(м/с$^2$)``."""
    if text in UNITS:
        return UNITS[text]
    found = re.fullmatch(r"(\(?)([\wµ ]+)/(s|m)(\$\^\d\$|\d|²|³)?(\)?)", text)
    if not found or found[2] not in UNITS:
        return text
    return f"{found[1]}{UNITS[found[2]]}/{UNITS[found[3]]}{found[4] or ''}{found[5]}"
