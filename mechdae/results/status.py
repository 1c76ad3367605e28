"""The statuses of poses and what they mean."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Any

import numpy as np


class Status(StrEnum):
    """The status of a pose, a state or a set of parameters: a text with its ``sentence``.

    In arrays of results and in the JSON they are the plain texts.
    """

    sentence: str

    def __new__(cls, text: str, sentence: str) -> Status:
        """Return the text with its sentence."""
        member = str.__new__(cls, text)
        member._value_, member.sentence = text, sentence
        return member

    OK = "ok", "the pose and its rates are certified"
    LIMIT = "limit", "a limit position: the pose is certified, rates are infinite"
    SINGULAR = "singular", "the equations lose rank there, or a certificate failed"
    AMBIGUOUS = (
        "ambiguous",
        "several branches or solutions are there, which one holds is open",
    )
    JAMMED = "jammed", "no effort moves it on: forces with friction have no solution"
    UNASSEMBLED = "unassembled", "no certified motion reaches the pose"
    REJECTED = "rejected", "a design with defects, which its sweep found"


FINE = (Status.OK, Status.LIMIT)
"""Poses that are certified."""
LOST = (Status.UNASSEMBLED, Status.SINGULAR)
"""Poses that have no values."""


def statuses(count: int, status: Status = Status.OK) -> Any:
    """Return an array (count,) of one status, into which every other one fits."""
    return np.full(count, str(status), dtype=f"<U{max(map(len, Status))}")


def counts(status: Iterable[str]) -> dict[str, int]:
    """Return the number of poses of each status."""
    array = np.asarray(status, dtype=str)
    found = {str(word): int(np.count_nonzero(array == word.value)) for word in Status}
    return {word: count for word, count in found.items() if count}
