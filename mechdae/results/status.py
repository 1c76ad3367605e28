"""The statuses of poses and what they mean."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mechdae.types import Booleans, Integers, Texts

if TYPE_CHECKING:
    from mechdae.results.shown import Shown


class Status(StrEnum):
    """The status of a pose, a state or a set of parameters: a text with its ``sentence``.

    In arrays of results and in the JSON they are the plain texts.

    Attributes
    ----------
    sentence : str
        What it says of a pose.

    Examples
    --------
    >>> md.Status("limit").sentence
    'a limit position: the pose is certified, rates are infinite'
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
    STOPPED = "stopped", "a joint is beyond its limits: the motion ends at a stop before"
    REJECTED = "rejected", "a design with defects, which its sweep found"


FINE = (Status.OK, Status.LIMIT)
"""Poses that are certified."""
UNREACHED = (Status.UNASSEMBLED, Status.STOPPED)
"""Poses that no motion comes to."""
LOST = (Status.UNASSEMBLED, Status.SINGULAR)
"""Poses that have no values."""
CODES = {status.value: code for code, status in enumerate(Status)}
"""The byte that stands for each status."""
TEXTS = np.array(list(CODES))


def statuses(count: int, status: Status = Status.OK) -> Texts:
    """Return an array (count,) of one status, into which every other one fits."""
    return np.full(count, str(status), dtype=TEXTS.dtype)


def coded(status: object) -> Any:
    """Return statuses (n,) as bytes; texts that are no `Status` stay an array of texts."""
    array = np.asarray(status)
    if array.dtype == np.uint8:
        return array
    words = array.astype(str)
    codes = np.zeros(len(words), np.uint8)
    known = words == TEXTS[0]
    for word, code in list(CODES.items())[1:]:
        rows = words == word
        codes[rows], known = code, known | rows
    return codes if known.all() else words


def texts(codes: Integers) -> Any:
    """Return statuses as texts (n,), read-only."""
    array = TEXTS[codes] if codes.dtype == np.uint8 else codes.copy()
    array.setflags(write=False)
    return array


def among(codes: Integers, kinds: Iterable[Status]) -> Booleans:
    """Return which of some bytes stand for one of these statuses, (n,)."""
    table = np.zeros(len(CODES), bool)
    table[[CODES[kind.value] for kind in kinds]] = True
    return table[codes]


def stretches(there: ArrayLike) -> list[tuple[int, int]]:
    """Return the first pose and that behind the last one of each stretch where something holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(there, int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def counts(status: object) -> dict[str, int]:
    """Return the number of poses of each status, given as texts or bytes."""
    found = np.bincount(coded(status), minlength=len(CODES)).tolist()
    return {word: found[code] for word, code in CODES.items() if found[code]}


class StatusOfPoses:
    """The statuses of a result: kept as one byte each, read as an array of texts."""

    def __get__(self, result: Shown, kind: type[Shown] | None = None) -> Any:
        """Return the texts (n,), made when they are first read."""
        if result is None:
            return ()
        known = result.__dict__
        if "_status" not in known:
            known["_status"] = texts(known["_codes"])
        return known["_status"]

    def __set__(self, result: Shown, status: object) -> None:
        """Keep statuses given as texts or bytes."""
        result.__dict__.pop("_status", None)
        result.__dict__["_codes"] = coded(status)


class Cause(StrEnum):
    """What keeps a pose from having values: told apart, for statuses do not."""

    OPEN = "open"
    RANK = "rank"
    CERTIFICATE = "certificate"


def why_lost(entry: Mapping[str, object]) -> str:
    """Return what an entry of `failed` says of its group: how it is there."""
    cause, least = entry.get("cause", Cause.OPEN), entry.get("least_singular_value")
    if cause == Cause.RANK:
        return f"loses rank there (least singular value {least:.2g} of the largest)"
    if cause == Cause.CERTIFICATE:
        return (
            f"assembles there and keeps its rank (least singular value {least:.2g} of the "
            "largest), but no certificate holds"
        )
    return f"opens at joint {entry['joint']}" if entry["joint"] else "stays open"
