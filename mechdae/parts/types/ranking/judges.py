"""Weights by judges who compare criteria in pairs, and how far the judges agree.

Sources: T. L. Saaty, The Analytic Hierarchy Process, McGraw-Hill 1980 (principal eigenvector,
consistency ratio); J. Aczel, T. L. Saaty, J. Math. Psychol. 27 (1983) 93-102 (geometric mean of
several judges); M. G. Kendall, B. Babington Smith, Ann. Math. Stat. 10 (1939) 275-287 (W).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from mechdae.describe.expression import evaluate
from mechdae.errors import InputError, ProblemFileError, UnknownName
from mechdae.records import dataclass
from mechdae.types import Floats, Json, Matrix

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


RANDOM = (0.0, 0.0, 0.58, 0.90, 1.12, 1.24, 1.32, 1.41, 1.45, 1.49)
"""Mean consistency index of random matrices of 1, 2, ... criteria (Saaty 1980)."""
CONSISTENT = 0.1
"""Consistency ratio up to which comparisons are accepted."""
RECIPROCAL = 1e-9
"""How far the product of a comparison and its opposite may be from 1."""


@dataclass(frozen=True)
class Judge:
    """The weights of one judge, ``ratio`` of consistency, and the pair that contradicts most."""

    name: str
    weights: Mapping[str, float]
    ratio: float
    worst: tuple[str, str]

    @property
    def consistent(self) -> bool:
        """Whether the ratio is at most 0.1."""
        return self.ratio <= CONSISTENT


@dataclass(frozen=True)
class Judgment:
    """Weights of criteria by all judges together, and their agreement.

    Attributes
    ----------
    weights
        Of each criterion, 1 together.
    agreement
        Kendall's coefficient of concordance W of the judges' weights: 1 where all rank alike, 0
        where there is no common order, and 1 for a single judge.
    judges
        Each with its weights, its ratio of consistency and the worst pair.
    grades
        Of criteria in words: the scale, and the words that were given.

    Examples
    --------
    >>> md.judged({"anna": {"loss / size": 3}, "ben": {"loss / size": 2}}).agreement
    1.0
    """

    weights: Mapping[str, float]
    agreement: float
    judges: tuple[Judge, ...]
    grades: Grades

    @property
    def notes(self) -> tuple[str, ...]:
        """A line for each inconsistent judge, with the pair that contradicts the others most."""
        return tuple(
            f"judge {judge.name} is inconsistent: the ratio {judge.ratio:.2g} is above "
            f"{CONSISTENT:g}, most of all in {judge.worst[0]} / {judge.worst[1]}"
            for judge in self.judges
            if not judge.consistent
        )

    def to_dict(self) -> Json:
        """Return it as in the JSON."""
        judges = [{"name": judge.name, "weights": dict(judge.weights), "ratio": judge.ratio,
                   "worst": list(judge.worst)} for judge in self.judges]  # fmt: skip
        together = {"weights": dict(self.weights), "agreement": self.agreement, "judges": judges}
        return together | (self.grades.to_dict() if self.grades.words else {})


def judged(
    judges: Mapping[str, Mapping[str, float | str]] | str | Path,
    grades: GradesGiven | None = None,
    scale: Mapping[str, float] | None = None,
) -> Judgment:
    """Return the weights of criteria that judges compare in pairs, and their grades in words.

    Parameters
    ----------
    judges
        Judge -> ``"loss / depth"`` -> how many times more important the first is than the second,
        1 to 9 or 1/9 to 1 by custom; or a TOML file with a table ``[judges.NAME]`` for each. Each
        judge compares each pair once; a pair given both ways has to be reciprocal. A file may
        hold ``[grades.CRITERION]`` and ``[scale]`` too, and then no judges.
    grades
        Criterion -> variant -> a word of the scale, or judge -> word. They become criteria of
        `md.rank` by the numbers of the words, the mean of the judges'.
    scale
        Word -> number, more is better; absent: good 1, fair 0.5, poor 0.

    Returns
    -------
    Judgment
        Weights for `rank`.

    Raises
    ------
    InputError
        A pair that is missing, not reciprocal or not above 0, criteria that differ by judge, a
        word that is not in the scale.

    Examples
    --------
    >>> pairs = {"loss / depth": 3, "loss / size": 5, "depth / size": 2}
    >>> {name: round(w, 3) for name, w in md.judged({"anna": pairs}).weights.items()}
    {'loss': 0.648, 'depth': 0.23, 'size': 0.122}
    """
    tables: Mapping[str, Mapping[str, float | str]]
    if isinstance(judges, str | Path):
        tables, in_file, scale_in_file = _read(Path(judges))
        grades = in_file if grades is None else grades
        scale = scale_in_file if scale is None else scale
    else:
        tables = judges
    words = graded(grades or {}, scale, list(tables))
    if not tables and grades:
        return Judgment({}, 1.0, (), words)
    if not tables:
        raise InputError("there are no judges", where="judges")
    names: list[str] = []
    matrices: dict[str, Matrix] = {}
    for judge, pairs in tables.items():
        here = list(dict.fromkeys(n for pair in pairs for n in _criteria(pair, judge)))
        if not here:
            raise InputError("no criteria are compared", where=f"judges.{judge}")
        names = names or here
        for name in here:
            if name not in names:
                raise UnknownName("criterion", name, names, where=f"judges.{judge}")
        matrices[judge] = _matrix(pairs, names, judge)
    found = tuple(_judge(judge, matrix, names) for judge, matrix in matrices.items())
    mean = np.exp(np.mean([np.log(matrix) for matrix in matrices.values()], axis=0))
    weights, _ = principal(mean)
    each = np.array([[judge.weights[name] for name in names] for judge in found])
    return Judgment(
        dict(zip(names, weights.tolist(), strict=True)), concordance(each), found, words
    )


def principal(matrix: Matrix) -> tuple[Floats, float]:
    """Return the principal eigenvector (n,) of positive numbers, 1 in all, and its eigenvalue."""
    values, vectors = np.linalg.eig(matrix)
    k = int(np.argmax(values.real))
    vector = np.abs(vectors[:, k].real)
    return vector / vector.sum(), float(values[k].real)


def concordance(scores: Floats) -> float:
    """Return Kendall's W of the scores (judges, things), corrected for ties."""
    judges, things = scores.shape
    if judges < 2 or things < 2:
        return 1.0
    ranks = np.array([_ranks(row) for row in scores])
    spread = float(((ranks.sum(axis=0) - judges * (things + 1) / 2) ** 2).sum())
    ties = sum(int(t) ** 3 - int(t) for row in ranks for t in np.unique(row, return_counts=True)[1])
    whole = judges**2 * (things**3 - things) - judges * ties
    return 12 * spread / whole if whole > 0 else 1.0


def _ranks(row: Floats) -> Floats:
    """Return ranks from 1 on, equal scores sharing their mean."""
    near = np.round(row, 12)
    return np.array([(near < x).sum() + ((near == x).sum() + 1) / 2 for x in near])


def _judge(name: str, matrix: Matrix, criteria: Sequence[str]) -> Judge:
    weights, largest = principal(matrix)
    n = len(criteria)
    index = (largest - n) / (n - 1) if n > 1 else 0.0
    random = RANDOM[min(n, len(RANDOM)) - 1]
    off = np.abs(np.log(matrix * weights[None, :] / weights[:, None]))
    i, j = (int(k) for k in np.unravel_index(int(np.argmax(off)), off.shape))
    worst = (criteria[min(i, j)], criteria[max(i, j)])
    ratio = max(index, 0.0) / random if random else 0.0
    return Judge(name, dict(zip(criteria, weights.tolist(), strict=True)), ratio, worst)


def _matrix(pairs: Mapping[str, float | str], names: Sequence[str], judge: str) -> Matrix:
    """Return the matrix of comparisons, checked."""
    found = np.full((len(names), len(names)), np.nan)
    np.fill_diagonal(found, 1.0)
    for pair, text in pairs.items():
        where = f"judges.{judge}.{pair}"
        i, j = (names.index(name) for name in _criteria(pair, judge))
        value = evaluate(text, {})
        if not value > 0 or not np.isfinite(value):
            raise InputError(f"a number above 0 is needed, not {text!r}", where=where)
        if np.isfinite(found[i, j]) and abs(found[i, j] / value - 1) > RECIPROCAL:
            raise InputError(
                f"{names[j]} / {names[i]} says {found[j, i]:.6g}: the two are not reciprocal",
                where=where,
                hint=f"{found[i, j]:.6g} here, or leave one of them out",
            )
        found[i, j], found[j, i] = value, 1 / value
    for i, j in combinations(range(len(names)), 2):
        if not np.isfinite(found[i, j]):
            raise InputError(
                f"{names[i]} / {names[j]} is missing", where=f"judges.{judge}",
                hint="each pair is compared once",
            )  # fmt: skip
    return found


def _criteria(pair: str, judge: str) -> tuple[str, str]:
    first, slash, second = (part.strip() for part in pair.partition("/"))
    if not slash or not first or not second or first == second:
        raise InputError(
            "two criteria are compared", where=f"judges.{judge}.{pair}", hint='"loss / depth" = 3'
        )
    return first, second


def _read(
    path: Path,
) -> tuple[dict[str, dict[str, float | str]], GradesGiven, dict[str, float] | None]:
    """Return the tables of judges, of grades, and the scale of a file."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ProblemFileError(f"cannot be read: {error.strerror}", where=str(path)) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ProblemFileError(str(error), where=str(path)) from None
    for name in data:
        if name not in ("judges", "grades", "scale"):
            raise UnknownName("table", name, ["judges", "grades", "scale"], where=str(path))
    tables, grades, scale = data.get("judges", {}), data.get("grades", {}), data.get("scale")
    for one in (tables, grades, {} if scale is None else scale):
        if not isinstance(one, dict):
            raise InputError("a table is needed", where=str(path), hint="[judges.NAME]")
    if not all(isinstance(one, dict) for one in tables.values()) or not (tables or grades):
        raise InputError("a table [judges.NAME] for each judge is needed", where=str(path))
    return tables, grades, scale
