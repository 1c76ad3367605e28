"""``mechdae modules``: the catalogue of vector modules."""

from __future__ import annotations

import argparse
import json

from mechdae.cli.progress import say
from mechdae.motion.modules.catalogue import PLANAR, SPATIAL, Module

LETTERS = {"a": "\u03b1", "b": "\u03b2"}


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="one JSON object")


def run(options: argparse.Namespace) -> int:
    if options.json:
        parts = {"planar": PLANAR, "spatial": SPATIAL}
        print(json.dumps({word: [m.plain() for m in part] for word, part in parts.items()}))
        return 0
    print("planar modules (length l, angle \u03b1), two equations")
    for module in PLANAR:
        say(_lines(module))
    print("\nspatial modules (length l, elevation \u03b1, azimuth \u03b2), three equations")
    for module in SPATIAL:
        say(_lines(module))
    return 0


def _lines(module: Module) -> str:
    letters = [", ".join(LETTERS.get(letter, letter) for letter in u) for u in module.unknowns]
    head = f"{module.number:4d}  {module.name:6s} {' | '.join(letters)}: {' + '.join(module.sets)}"
    if module.singular:
        return f"{head}\n      structurally singular: {module.equation}; {module.degenerate}"
    many = "1 solution" if module.solutions == 1 else f"{module.solutions} solutions at most"
    return (
        f"{head}\n      {module.equation}, degree {module.degree}, {many}\n"
        f"      det J = {module.determinant}; degenerate: {module.degenerate}"
    )
