"""casadi functions that are read from disk where an earlier process has built them."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca

from mechdae import __version__
from mechdae.equations.structure_cache import structure_property
from mechdae.kernels.stored.folder import Folder, place
from mechdae.types import Graph

SOURCES = (
    "describe", "describe/tasks", "equations", "equations/forces", "equations/tree", "forces",
    "kernels", "kernels/bounds", "kernels/graphs", "kernels/run", "kernels/stored",
)  # fmt: skip
"""Folders of the package whose code decides what kernels are."""


@cache
def folder() -> Folder | None:
    """Return the folder of this process, None where nothing is kept on disk."""
    path = place()
    return None if path is None else Folder(path)


def functions_are_kept() -> bool:
    """Say whether this process keeps functions on disk."""
    return folder() is not None


@cache
def versions() -> str:
    """Return what kernels depend on beside their equations: versions, and the state of the code."""
    package = Path(__file__).parents[2]
    states = []
    for name in SOURCES:
        with suppress(OSError), os.scandir(package / name) as entries:
            for entry in entries:
                if entry.name.endswith(".py"):
                    about = entry.stat()
                    states.append((name, entry.name, about.st_size, about.st_mtime_ns))
    return repr((__version__, ca.CasadiMeta.version(), sorted(states)))


def fingerprint(*parts: object) -> str:
    """Return the name of what is built from functions and from values with a text of their own."""
    whole = hashlib.sha256(versions().encode())
    for part in parts:
        text = part.serialize() if isinstance(part, ca.Function) else repr(part)
        whole.update(f"{len(text)}:{text}".encode())
    return whole.hexdigest()


def stored(name: str, make: Callable[[], Graph]) -> Graph:
    """Return the function that is kept under a name; `make` builds it where there is none."""
    store = folder()
    text = store.read(name) if store is not None else None
    if store is not None and text is not None:
        try:
            return ca.Function.deserialize(text)
        except RuntimeError:  # of another build of casadi
            store.forget(name)
    made = make()
    if store is not None:
        store.write(name, made.serialize())
    return made


class stored_property(structure_property[Graph]):  # noqa: N801  (used like `property`)
    """A `structure_property` that is a casadi function, kept on disk too.

    Its owner's `fingerprint` names the equations that it is built from; None: it is not kept.
    """

    def built(self, instance: Any) -> Graph:
        if not functions_are_kept() or instance.fingerprint is None:
            return self.make(instance)
        name = fingerprint(instance.fingerprint, self.key)
        return stored(name, lambda: self.make(instance))
