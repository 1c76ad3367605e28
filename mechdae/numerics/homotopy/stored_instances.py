"""Generic linkages with all their solutions: shipped, or kept on disk once they were computed.

Stored are single precision numbers and solutions in the canonical numbering of the structure. What
is read is refined and certified before it is used.
"""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from mechdae.numerics.homotopy.canonical import Canonical, canonical
from mechdae.numerics.homotopy.certified_poses import apart, certify
from mechdae.numerics.homotopy.linkage import ComplexDimensions, PinLinkage
from mechdae.numerics.homotopy.monodromy import generic_instance, within_a_turn
from mechdae.records import dataclass
from mechdae.types import Complexes

STORE = Path(__file__).resolve().parent / "trusses.npz"
MOST_UNKNOWNS = 8
"""Unknowns up to which what is not stored is computed."""
NEWTON = 6


class KeptTexts(Protocol):
    """Texts by name that outlive the process."""

    def read(self, name: str) -> str | None: ...

    def write(self, name: str, text: str) -> None: ...


@dataclass(frozen=True)
class Instance:
    """Generic ``numbers`` of a ``linkage``, all solutions ``x`` (N, k).

    ``whole`` tells that a theorem allows no more.
    """

    linkage: PinLinkage
    numbers: ComplexDimensions
    x: Complexes
    whole: bool


_known: dict[str, Instance | None] = {}


@cache
def _shipped() -> dict[str, Complexes]:
    with np.load(STORE, allow_pickle=False) as data:
        return dict(data)


def file_name(text: str) -> str:
    """Return the name under which a structure is kept."""
    return hashlib.sha256(f"poses 1 {text}".encode("ascii")).hexdigest()[:24]


def instance_of(
    linkage: PinLinkage, folder: KeptTexts | None = None
) -> tuple[Instance, Canonical] | None:
    """Return a generic linkage of this structure, and how the given one is numbered in it.

    What is not stored is computed, which takes seconds, where it is small enough, and kept in the
    `folder`; where no theorem tells how many solutions there are only if there is one. None: there
    is none.
    """
    form = canonical(linkage)
    name = form.name
    found = _known.get(name)
    if found is None:
        found = _stored(form.linkage, name, folder)
    if found is None and name not in _known and linkage.unknowns <= MOST_UNKNOWNS:
        if form.linkage.count is None and folder is None:
            return None
        found = _computed(form.linkage, name, folder)
        _known[name] = found
    if found is None:
        return None
    _known[name] = found
    return found, form


def _stored(linkage: PinLinkage, name: str, folder: KeptTexts | None) -> Instance | None:
    key = file_name(name)
    shipped = _shipped()
    if key in shipped:
        return read(linkage, shipped[key])
    text = folder.read(key) if folder is not None else None
    if text is None:
        return None
    try:
        data = np.frombuffer(base64.b64decode(text, validate=True), np.complex64)
    except ValueError:
        return None
    return read(linkage, data)


def _computed(linkage: PinLinkage, name: str, folder: KeptTexts | None) -> Instance | None:
    numbers, x, whole = generic_instance(linkage)
    if linkage.count is not None and not whole:
        return None
    data = written(numbers, x)
    found = read(linkage, data)
    if found is not None and folder is not None:
        folder.write(file_name(name), base64.b64encode(data.tobytes()).decode("ascii"))
    return found


def written(numbers: ComplexDimensions, x: Complexes) -> Complexes:
    """Return numbers and solutions in a row of single precision."""
    return np.concatenate([*numbers.parts, x.ravel()]).astype(np.complex64)


def read(linkage: PinLinkage, data: Any) -> Instance | None:
    """Return what a row holds, refined; None where it is not what it should be."""
    e, k, n = len(linkage.steps), len(linkage.slides), linkage.unknowns
    head = 2 * (e + k)
    if data.ndim != 1 or len(data) <= head or (len(data) - head) % n:
        return None
    own = np.asarray(data, complex)
    numbers = ComplexDimensions(*np.split(own[:head], [e, e + k, 2 * e + k]))
    x = own[head:].reshape(-1, n)
    system, start = linkage.system([numbers]), np.zeros(len(x))
    with np.errstate(all="ignore"):
        for _ in range(NEWTON):
            F, J, _ = system(x, start)
            try:
                x = x - np.linalg.solve(J, F[..., None])[..., 0]
            except np.linalg.LinAlgError:
                return None
    x = within_a_turn(linkage, x)
    found = certify(linkage, numbers, x, real=False)
    if not found.simple.all() or not apart(found):
        return None
    count = linkage.count
    if count is not None and len(x) != count:
        return None
    return Instance(linkage, numbers, x, count is not None)
