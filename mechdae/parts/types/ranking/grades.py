"""Criteria that are judged in words of a scale, by one judge or several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mechdae.errors import InputError, UnknownName
from mechdae.records import dataclass
from mechdae.types import Json

SCALE = {"good": 1.0, "fair": 0.5, "poor": 0.0}
"""The words of grades where no scale is given."""
GradesGiven = Mapping[str, Mapping[str, str | Mapping[str, str]]]
"""Criterion -> variant -> a word, or judge -> word."""


@dataclass(frozen=True)
class Grades:
    """Grades in words: ``scale`` word -> number, more is better; ``words`` as they were given."""

    scale: Mapping[str, float]
    words: GradesGiven

    def value(self, criterion: str, variant: str, judge: str | None = None) -> float | None:
        """Return the number of a grade, the mean of all judges' without one; None: none given."""
        given = self.words[criterion].get(variant)
        if given is None or isinstance(given, str):
            return None if given is None else self.scale[given]
        words = given.values() if judge is None else [given[judge]]
        return float(np.mean([self.scale[word] for word in words]))

    def check_names(self, variants: Sequence[str]) -> None:
        """Raise `UnknownName` for a grade of a variant that there is not."""
        for criterion, given in self.words.items():
            for name in given:
                if name not in variants:
                    raise UnknownName("variant", name, variants, where=f"grades.{criterion}")

    def to_dict(self) -> Json:
        """Return it as in the JSON."""
        return {"scale": dict(self.scale), "grades": {
            criterion: {name: word if isinstance(word, str) else dict(word)
                        for name, word in given.items()}
            for criterion, given in self.words.items()
        }}  # fmt: skip


def graded(grades: GradesGiven, scale: Mapping[str, float] | None, judges: Sequence[str]) -> Grades:
    """Return grades, checked; `judges` are those who compare criteria in pairs."""
    numbers = {**(SCALE if scale is None else scale)}
    for word, number in numbers.items():
        plain = isinstance(number, int | float) and not isinstance(number, bool)
        if not plain or not np.isfinite(number):
            raise InputError(f"a number is needed, not {number!r}", where=f"scale.{word}")
    if len({*numbers.values()}) < max(len(numbers), 2):
        raise InputError("a scale needs two words at least, each with a number of its own",
                         where="scale")  # fmt: skip
    for criterion, given in grades.items():
        if not isinstance(given, Mapping):
            raise InputError("a word for each variant is needed", where=f"grades.{criterion}",
                             hint='VARIANT = "good"')  # fmt: skip
        for variant, words in given.items():
            _check(words, numbers, judges, f"grades.{criterion}.{variant}")
    return Grades(numbers, grades)


def _check(words: object, scale: Mapping[str, float], judges: Sequence[str], where: str) -> None:
    """Raise for a grade that is no word of the scale, or not by all judges."""
    by_judge = words if isinstance(words, Mapping) else {"": words}
    for judge, word in by_judge.items():
        if judge and judge not in judges:
            raise UnknownName("judge", judge, judges, where=where)
        if word not in scale:
            raise UnknownName("grade", str(word), list(scale), where=where)
    if isinstance(words, Mapping):
        for judge in judges:
            if judge not in words:
                raise InputError(f"judge {judge} gives no grade", where=where)
