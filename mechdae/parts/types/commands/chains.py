"""``mechdae chains``: kinematic chains, their inversions, drivers and kinds of pairs."""

from __future__ import annotations

import argparse
import itertools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from mechdae.cli import message
from mechdae.describe import whole_file
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.parts.types.chains.chains import KinematicChain
    from mechdae.types import Json

EACH = ("inversions", "drivers", "pairs")
"""What chains are listed by."""
PICTURES = (".svg", ".png", ".pdf")
SHOWN = 40
"""Lines of the table; ``--json`` and ``--out`` have all."""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--links", type=int, required=True, metavar="N", help="number of links")
    parser.add_argument("--freedoms", type=int, default=1, metavar="F", help="0 to 3, usually 1")
    parser.add_argument("--inversions", action="store_true", help="each link as the fixed one")
    parser.add_argument("--drivers", action="store_true", help="each joint of it as the driver")
    parser.add_argument("--pairs", action="store_true", help="revolute or prismatic at each joint")
    parser.add_argument("--groups", action="store_true", help="Assur groups with N links")
    parser.add_argument("--count", action="store_true", help="only how many there are")
    parser.add_argument(
        "--formula", action="store_true", help="structural formula of each, with --drivers"
    )
    parser.add_argument(
        "--out", metavar="FILE", help="all of them as .json, or drawn as .svg, .png, .pdf"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object")


def run(options: argparse.Namespace) -> int:
    _check(options)
    head: dict[str, int] = {"links": options.links, "freedoms": options.freedoms}
    if options.count:
        number = _count(options)
        print(json.dumps(head | {"count": number}) if options.json else number)
        return 0
    found = _found(options)
    if options.out and Path(options.out).suffix in PICTURES:
        return _drawn(options, found)
    if options.json or options.out:
        entries = [_entry(chain, options.formula) for chain in found]
        text = json.dumps(head | {"count": len(entries), "chains": entries})
        if options.out:
            with whole_file(Path(options.out)) as file:
                file.write(text.encode())
            message(f"mechdae: {len(entries)} chains in {options.out}", options.quiet)
        if options.json:
            print(text)
        return 0
    number = 0
    for number, chain in enumerate(itertools.islice(found, SHOWN), start=1):
        print(f"{number:4}  {_line(chain, options.formula)}")
    more = sum(1 for _ in found) if not options.pairs else _count(options) - number
    print(f"{number + more} in all" + (f", {more} not shown: --json, --out" if more else ""))
    return 0


def _check(options: argparse.Namespace) -> None:
    if options.groups:
        named = [f"--{word}" for word, wanted in _each(options).items() if wanted]
        if named or options.freedoms != 1:
            raise InputError(
                f"Assur groups have no {', '.join(named) or '--freedoms'}", where="--groups"
            )
        options.freedoms = 0
    if options.formula and not options.drivers:
        raise InputError("a formula begins with the driver", where="--formula", hint="--drivers")
    if options.out:
        path = Path(options.out)
        if path.suffix not in (*PICTURES, ".json"):
            raise InputError(
                f"cannot write '{path.suffix or path.name}'",
                where="--out",
                hint=f"a name that ends in .json, {', '.join(PICTURES)}",
            )
        if path.exists():
            raise InputError("exists already", where=options.out, hint="choose another name")
        if not path.parent.is_dir():
            raise InputError("no such folder", where=str(path.parent))


def _found(options: argparse.Namespace) -> Iterator[KinematicChain]:
    from mechdae.parts.types.chains.chains import assur_groups, chains

    if options.groups:
        return assur_groups(options.links)
    return chains(options.links, options.freedoms, **_each(options))


def _count(options: argparse.Namespace) -> int:
    from mechdae.parts.types.chains.chains import count_chains

    if options.groups:
        return sum(1 for _ in _found(options))
    return count_chains(options.links, options.freedoms, **_each(options))


def _each(options: argparse.Namespace) -> dict[str, bool]:
    return {word: vars(options)[word] for word in EACH}


def _entry(chain: KinematicChain, with_formula: bool) -> Json:
    entry: Json = {"joints": [list(joint) for joint in chain.joints]}
    for word in ("fixed", "driver", "pairs"):
        if getattr(chain, word) is not None:
            entry[word] = getattr(chain, word)
    return entry | ({"formula": _formula(chain)} if with_formula else {})


def _line(chain: KinematicChain, with_formula: bool) -> str:
    joints = " ".join(f"{i}-{j}" for i, j in chain.joints)
    parts = [joints]
    if chain.fixed is not None:
        parts.append(f"fixed {chain.fixed}")
    if chain.driver is not None:
        parts.append("driver {}-{}".format(*chain.joints[chain.driver]))
    parts += [chain.pairs] if chain.pairs else []
    parts += [_formula(chain)] if with_formula else []
    return "  ".join(parts)


def _formula(chain: KinematicChain) -> str:
    from mechdae.parts.types.chains.mechanisms import problem_of
    from mechdae.tasks.show import structure

    entry = structure(problem_of(chain))["formulas"][0]
    return str(entry.get("formula") or entry.get("error"))


def _drawn(options: argparse.Namespace, found: Iterator[KinematicChain]) -> int:
    from mechdae.draw import save
    from mechdae.parts.types.drawn.atlas import MOST, atlas

    chosen = list(itertools.islice(found, MOST + 1))
    if len(chosen) > MOST:
        raise InputError(f"more than {MOST} do not fit on a sheet", where="--out", hint=".json")
    what = "Assur groups" if options.groups else "chains"
    save(atlas(chosen, f"{len(chosen)} {what} with {options.links} links"), options.out)
    message(f"mechdae: {len(chosen)} {what} in {options.out}", options.quiet)
    return 0
