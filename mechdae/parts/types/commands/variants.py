"""``mechdae variants P``: orders, fixed links, kinds of pairs, constructions of pins."""

from __future__ import annotations

import argparse
import itertools
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of
from mechdae.describe import whole_file
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.parts.types.chains.variants.scheme import Variant

SHOWN = 40
"""Lines of the table; ``--json`` and ``--out`` have all."""
MOST = 20_000
"""Variants that are written without ``--limit``."""


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument(
        "--by",
        required=True,
        choices=("order", "inversion", "pairs", "construction"),
        help="loop orders, fixed links, R or P at the joints, constructions of pins",
    )
    parser.add_argument("--limit", type=int, metavar="N", help="list the first N")
    parser.add_argument("--out", metavar="DIR", help="write each as a problem file")
    parser.add_argument("--json", action="store_true", help="one JSON object")


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.types.ranking.variants import count_variants, variants

    problem = problem_of(options)
    count, different = count_variants(problem, options.by)
    found = variants(problem, options.by, limit=options.limit)
    whole = options.json or options.out
    if whole and options.limit is None and count > MOST:
        raise InputError(
            f"{count} variants are more than {MOST} at once", where="--by", hint="--limit N"
        )
    if not whole:
        _listed(itertools.islice(found, SHOWN), count, different, options.limit)
        return 0
    folder = _folder(options.out) if options.out else None
    entries = []
    written = 0
    for variant in found:
        if folder is not None:
            _write(folder, variant)
            written += 1
        if options.json:
            entries.append(variant.to_dict())
    if options.json:
        head: dict[str, object] = {"count": count, "up_to_reversal": different}
        print(json.dumps(head | {"variants": entries}, ensure_ascii=False))
    if folder is not None:
        message(f"mechdae: {written} problem files in {options.out}", options.quiet)
    return 0


def _listed(found: Any, count: int, different: int, limit: int | None) -> None:
    number = 0
    for number, variant in enumerate(found, start=1):
        print(f"{number:5}  {variant.name}")
        for word in variant.left_out:
            print(f"       left out: {word}")
        if variant.fault:
            print(f"       does not assemble: {variant.fault}")
    more = min(count, limit or count) - number
    print(
        f"{count} in all"
        + (f", {different} up to reversal" if different != count else "")
        + (f"; {more} not shown: --json, --out" if more else "")
    )


def _folder(name: str) -> Path:
    folder = Path(name)
    if folder.exists() and not folder.is_dir():
        raise InputError("is a file, not a folder", where=f"--out {name}")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _write(folder: Path, variant: Variant) -> None:
    """Write one problem file whole or not at all."""
    path = folder / f"{variant.name}.toml"
    if path.exists():
        raise InputError("exists already", where=str(path), hint="choose another folder")
    with whole_file(path) as file:
        file.write(variant.text.encode())
