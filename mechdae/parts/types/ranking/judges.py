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
    """Weights of criteria by all judges together, 1 in all, and their agreement.

    ``agreement`` is Kendall's coefficient of concordance W of the judges' weights: 1 where all
    rank alike, 0 where there is no common order, and 1 for a single judge.
    """

    weights: Mapping[str, float]
    agreement: float
    judges: tuple[Judge, ...]

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
        return {"weights": dict(self.weights), "agreement": self.agreement, "judges": judges}


def judged(judges: Mapping[str, Mapping[str, float | str]] | str | Path) -> Judgment:
    """Return the weights of criteria that judges compare in pairs.

    Parameters
    ----------
    judges
        Judge -> ``"loss / depth"`` -> how many times more important the first is than the second,
        1 to 9 or 1/9 to 1 by custom; or a TOML file with a table ``[judges.NAME]`` for each. Each
        judge compares each pair once; a pair given both ways has to be reciprocal.

    Raises
    ------
    InputError
        A pair that is missing, not reciprocal or not above 0, criteria that differ by judge.

    Examples
    --------
    >>> import mechdae as md
    >>> pairs = {"loss / depth": 3, "loss / size": 5, "depth / size": 2}
    >>> {name: round(w, 3) for name, w in md.judged({"anna": pairs}).weights.items()}
    {'loss': 0.648, 'depth': 0.23, 'size': 0.122}
    """
    tables = _read(Path(judges)) if isinstance(judges, str | Path) else judges
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
    return Judgment(dict(zip(names, weights.tolist(), strict=True)), concordance(each), found)


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


def _read(path: Path) -> dict[str, dict[str, float | str]]:
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ProblemFileError(f"cannot be read: {error.strerror}", where=str(path)) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ProblemFileError(str(error), where=str(path)) from None
    tables = data.get("judges")
    if not isinstance(tables, dict) or not all(isinstance(one, dict) for one in tables.values()):
        raise InputError("a table [judges.NAME] for each judge is needed", where=str(path))
    found: dict[str, dict[str, float | str]] = tables
    return found
