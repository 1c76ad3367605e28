"""Generic linkages with all their solutions: shipped, or by monodromy, kept on disk.

Stored are single precision numbers and solutions in the canonical numbering of the structure. What
is read is refined and certified before it is used.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from mechdae.numerics.homotopy.certified_poses import apart, certify
from mechdae.numerics.homotopy.linkage import ComplexDimensions, PinLinkage, instance, straight
from mechdae.numerics.homotopy.tracker import distinct, track
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Integers

SAME = 1e-6
MISSED = 1e-6
"""Chance that a solution stays hidden, where no theorem tells how many there are."""
TRIPS = 400
CLOSE = 1e-9
"""Last Newton step of an end that is a solution."""


def within_a_turn(linkage: PinLinkage, x: Complexes) -> Complexes:
    """Return solutions with the imaginary parts of turns between -pi and pi."""
    m = max(linkage.turns)
    x = np.array(x, complex)
    x[:, :m] -= 2j * np.pi * np.round(x[:, :m].imag / (2 * np.pi))
    return x


def different(linkage: PinLinkage, x: Complexes, same: float = SAME) -> Integers:
    """Return the indices of solutions (n, k) that are no copies of earlier ones."""
    m = max(linkage.turns)
    both = [np.exp(x[:, :m]), np.exp(-x[:, :m]), x[:, m:]]
    with np.errstate(all="ignore"):
        sizes = np.concatenate([value / (1 + np.abs(value)) for value in both], axis=1)
    return distinct(sizes, same)


def followed(
    linkage: PinLinkage, path: list[ComplexDimensions], x: Complexes
) -> tuple[Complexes, Booleans]:
    """Return where solutions lead along a path, and which are simple ones at its end."""
    ends = track(linkage.system(path), x, linkage.far)
    return ends.x, ends.followed & (ends.step < CLOSE)


def generic_instance(
    linkage: PinLinkage, seed: int = 1
) -> tuple[ComplexDimensions, Complexes, bool]:
    """Return complex numbers, all their solutions (N, k), whether a theorem allows no more.

    Where no theorem tells how many there are, round trips end when a solution that was missed by
    all of them is as unlikely as 1e-6, with a full group of permutations.
    """
    rng = np.random.default_rng(seed)
    numbers, first = instance(linkage, rng)
    known, wanted, silent = first[None], linkage.count, 0
    for _ in range(TRIPS):
        there, bend = (ComplexDimensions.drawn(linkage, rng) for _ in range(2))
        x = known
        for path in (straight(numbers, there), straight(there, numbers, bend)):
            x, good = followed(linkage, path, x)
            x = x[good]
            if not len(x):
                break
        every = np.concatenate([known, within_a_turn(linkage, x)])
        more = every[different(linkage, every)]
        silent = silent + 1 if len(more) == len(known) else 0
        known = more
        if wanted is not None and len(known) >= wanted:
            return numbers, known, len(known) == wanted
        if wanted is None and (1 / (len(known) + 1)) ** silent < MISSED:
            break
    return numbers, known, False


Code = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Canonical:
    """A linkage in its canonical numbering: part k is ``parts[k]`` of the given one, and so on."""

    linkage: PinLinkage
    parts: tuple[int, ...]
    pins: tuple[int, ...]
    turns: tuple[int, ...]
    slides: tuple[int, ...]

    @property
    def name(self) -> str:
        """Return the structure as text."""
        linkage = self.linkage
        parts = ".".join("-".join(map(str, pins)) for pins in linkage.parts)
        slides = ".".join(f"{part}-{pin}" for part, pin in linkage.slides)
        return f"{parts}|{'-'.join(map(str, linkage.turns))}|{slides}"


@lru_cache(256)
def canonical(linkage: PinLinkage) -> Canonical:
    """Return a linkage in its canonical numbering; which part is fixed makes no difference."""
    turns = sorted(set(linkage.turns))
    pins = sorted({p for part in linkage.parts for p in part} | {p for _, p in linkage.slides})
    parts = range(len(linkage.parts))
    nodes: list[tuple[str, int]] = [
        *(("turn", k) for k in turns),
        *(("part", k) for k in parts),
        *(("pin", k) for k in pins),
        *(("slide", k) for k in range(len(linkage.slides))),
    ]
    place = {node: k for k, node in enumerate(nodes)}
    edges = [(place["turn", turn], place["part", k]) for k, turn in enumerate(linkage.turns)]
    edges += [(place["part", k], place["pin", p]) for k in parts for p in linkage.parts[k]]
    for k, (part, pin) in enumerate(linkage.slides):
        edges += [(place["slide", k], place["part", part]), (place["slide", k], place["pin", pin])]
    kinds = ("turn", "part", "pin", "slide")
    order = canonical_order([kinds.index(kind) for kind, _ in nodes], edges)
    ranked = [nodes[k] for k in order]
    number = {
        node: sum(other[0] == node[0] for other in ranked[:k]) for k, node in enumerate(ranked)
    }
    new_turns, new_parts, new_pins, new_slides = (
        tuple(k for kind, k in ranked if kind == colour) for colour in kinds
    )
    return Canonical(
        PinLinkage(
            tuple(tuple(sorted(number["pin", p] for p in linkage.parts[k])) for k in new_parts),
            tuple(number["turn", linkage.turns[k]] for k in new_parts),
            tuple(
                (number["part", part], number["pin", pin])
                for part, pin in (linkage.slides[k] for k in new_slides)
            ),
        ),
        new_parts,
        new_pins,
        new_turns,
        new_slides,
    )


def canonical_order(colours: Sequence[int], edges: Sequence[tuple[int, int]]) -> list[int]:
    """Return the nodes of a coloured graph in an order that its numbering does not change.

    Colours are refined by those of the neighbours; where that leaves nodes alike, each of them
    comes first in turn and the least picture of the graph counts.
    """
    beside: list[list[int]] = [[] for _ in colours]
    for u, v in edges:
        beside[u].append(v)
        beside[v].append(u)

    def refined(colours: list[int]) -> list[int]:
        while True:
            seen = [
                (c, tuple(sorted(colours[v] for v in beside[u]))) for u, c in enumerate(colours)
            ]
            names = {key: k for k, key in enumerate(sorted(set(seen)))}
            ahead = [names[key] for key in seen]
            if len(names) == len(set(colours)):
                return ahead
            colours = ahead

    def least(colours: list[int]) -> tuple[Code, list[int]]:
        colours = refined(colours)
        cells: dict[int, list[int]] = {}
        for u, c in enumerate(colours):
            cells.setdefault(c, []).append(u)
        alike = [cell for _, cell in sorted(cells.items()) if len(cell) > 1]
        if not alike:
            code = [tuple(sorted(colours[v] for v in beside[u])) for u in range(len(colours))]
            order = sorted(range(len(colours)), key=colours.__getitem__)
            return tuple(code[u] for u in order), order
        cell = min(alike, key=len)
        if _twins(cell, beside):
            cell = cell[:1]
        return min(least([2 * c - (u == first) for u, c in enumerate(colours)]) for first in cell)

    return least(list(colours))[1]


def _twins(cell: list[int], beside: list[list[int]]) -> bool:
    """Return whether nodes have the same neighbours: then each may come first."""
    return len({tuple(sorted(beside[u])) for u in cell}) == 1


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
    known = np.asarray(data, complex)
    numbers = ComplexDimensions(*np.split(known[:head], [e, e + k, 2 * e + k]))
    x = known[head:].reshape(-1, n)
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
