"""Why a page plays recorded poses, or shows no forces, in the languages of pages."""

from __future__ import annotations

REASONS = {
    "kind": ("a task of kind {kind} is recorded", "задача вида {kind} записана"),
    "open": (
        "with bodies that do not assemble it is recorded",
        "со звеньями, которые не собираются, она записана",
    ),
    "corners": (
        "a law of time with corners is recorded",
        "закон времени с изломами записан",
    ),
    "begins": (
        "the way from the sketch to its first pose has an end: it is recorded",
        "путь от эскиза к первому положению кончается: она записана",
    ),
    "curves": (
        "with curves that end, are made of pieces or may have no tangent it is recorded",
        "с кривыми с концами, из кусков или без касательной она записана",
    ),
    "superfluous": (
        "with superfluous equations it is recorded",
        "с избыточными уравнениями она записана",
    ),
    "change points": (
        "its path goes through change points: it is recorded",
        "её путь проходит через точки ветвления: она записана",
    ),
    "change_point": (
        "its path ends at a change point: it is recorded",
        "её путь кончается в точке ветвления: она записана",
    ),
    "ambiguous": (
        "its path ends where branches cannot be told apart: it is recorded",
        "её путь кончается там, где ветви неразличимы: она записана",
    ),
    "cusp": (
        "its path ends at a cusp: it is recorded",
        "её путь кончается в точке возврата: она записана",
    ),
    "dead_point": (
        "its path ends at a dead point: it is recorded",
        "её путь кончается в мёртвой точке: она записана",
    ),
    "end_of_curve": (
        "its path ends at the end of a curve: it is recorded",
        "её путь кончается на конце кривой: она записана",
    ),
    "locked": (
        "its path ends where superfluous equations lock it: it is recorded",
        "её путь кончается там, где его запирают избыточные уравнения: она записана",
    ),
    "unproved": (
        "its path cannot be proved to its end: it is recorded",
        "её путь не доказывается до конца: она записана",
    ),
    "poses": (", {some} of {all} poses", ", {some} из {all} положений"),
    "space": (
        "in space only motions are shown",
        "в пространстве показаны только движения",
    ),
    "reactions": (
        "reactions of superfluous constraints are not unique",
        "реакции избыточных связей не единственны",
    ),
    "timed": ("a load is a table over the time", "нагрузка задана таблицей по времени"),
}
"""Sentences by what they are about: English, Russian."""


def said(key: str, lang: str, **facts: object) -> str:
    """Return a sentence in a language, "" without a key."""
    return REASONS[key][lang == "ru"].format(**facts) if key else ""
