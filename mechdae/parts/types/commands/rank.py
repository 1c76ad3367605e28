"""``mechdae rank P``: variants of a mechanism by size, criteria and weights."""

from __future__ import annotations

import argparse
import csv
import io
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae.cli import message
from mechdae.cli.options import (
    check_processes,
    problem_arguments,
    problem_of,
    process_arguments,
    units_argument,
    units_asked,
)
from mechdae.cli.progress import clear, progress
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.describe.units import Units
    from mechdae.parts.types.ranking.judges import Judgment
    from mechdae.parts.types.ranking.rank import RankedVariant, Ranking

SHOWN = 20
"""Variants in the table; ``--json`` and ``--out`` have all."""
WIDEST = 10_000
"""Columns where there is no terminal."""
DRAWN = 12
"""Variants on the sheet."""


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument("--variants", metavar="DIR", help="problem files of `mechdae variants`")
    parser.add_argument(
        "--by",
        choices=("order", "inversion", "pairs", "construction"),
        help="without a folder: what is varied, construction",
    )
    parser.add_argument("--limit", type=int, metavar="N", help="only the first N variants")
    parser.add_argument("--task", metavar="T", help="a sweep or reactions; default: the first")
    for word, text in (
        ("--weights", "weights of criteria, 1 together; default: equal ones"),
        ("--within", "limits that come first: width=0.3, layers=4, width_mm=300"),
    ):
        parser.add_argument(word, nargs="+", action="extend", metavar="NAME=W", help=text)
    parser.add_argument(
        "--judges",
        metavar="FILE",
        help="comparisons in pairs that give the weights, and grades in words: TOML",
    )
    parser.add_argument(
        "--criteria", nargs="+", action="extend", metavar="NAME", help="only these; default: all"
    )
    parser.add_argument("--output", metavar="C", help="coordinate whose acceleration counts")
    process_arguments(parser)
    units_argument(parser)
    parser.add_argument("--out", metavar="DIR", help="table, problem files of the best, pictures")
    parser.add_argument("--json", action="store_true", help="one JSON object")


def run(options: argparse.Namespace) -> int:
    from mechdae.cli.terminal import width_of
    from mechdae.describe.units import units_of
    from mechdae.parts.types.ranking.judges import judged
    from mechdae.parts.types.ranking.rank import rank

    check_processes(options)
    if options.variants and options.by:
        raise InputError("not together with --variants", where=f"--by {options.by}")
    if options.cluster:
        raise InputError("a ranking has --workers", where="--cluster")
    if options.out and Path(options.out).exists() and not Path(options.out).is_dir():
        raise InputError("is a file, not a folder", where=f"--out {options.out}")
    judgment = judged(options.judges) if options.judges else None
    problem = problem_of(options)
    units = units_of(units_asked(options), problem.mechanism.units)
    show = progress("variants", options.quiet)
    try:
        ranking = rank(
            problem,
            options.task,
            variants=options.variants,
            by=options.by or "construction",
            weights=_numbers(options.weights, "--weights"),
            judges=judgment,
            criteria=options.criteria,
            within=_numbers(options.within, "--within"),
            output=options.output,
            limit=options.limit,
            workers=options.workers,
            progress=show,
        )
    finally:
        clear(show)
    if options.json:
        data = ranking.to_dict() | ({"judgment": judgment.to_dict()} if judgment else {})
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))
    else:
        if judgment:
            print("\n".join(_judges(judgment)))
        print("\n".join(_table(ranking, units, width_of(sys.stdout) or WIDEST)))
    if options.out:
        _written(ranking, Path(options.out), options.quiet)
    if not ranking.order:
        message("mechdae: no variant is left to be ranked", options.quiet)
        return 1
    return 0


def _judges(judgment: Judgment) -> list[str]:
    """Return what judges say together, who is inconsistent, and what words stand for."""
    count, words = len(judgment.judges), judgment.grades.words
    scale = ", ".join(f"{word} {number:g}" for word, number in judgment.grades.scale.items())
    lines = [f"  {', '.join(words)}: {scale}; more is better, the mean of judges"] if words else []
    if not count:
        return lines
    weights = ", ".join(f"{name} {weight:.4g}" for name, weight in judgment.weights.items())
    agree = f", agreement W = {judgment.agreement:.3g}" if count > 1 else ""
    ratios = ", ".join(f"{judge.name} {judge.ratio:.2g}" for judge in judgment.judges)
    judges = f"{count} judge{'s' * (count > 1)}"
    lines += [f"  weights of {judges}{agree}: {weights}", f"  consistency ratios: {ratios}"]
    return [*lines, *(f"  note: {note}" for note in judgment.notes)]


def _numbers(pairs: list[str] | None, option: str) -> dict[str, float] | None:
    """Return name -> number of NAME=NUMBER, with the unit of the name converted."""
    from mechdae.describe.file.reading import split_unit, to_si

    if pairs is None:
        return None
    found: dict[str, float] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        try:
            number = float(text)
        except ValueError:
            equals = ""
        if not equals or not name:
            raise InputError(f"'{pair}' is not NAME=NUMBER", where=option)
        base, suffix = split_unit(name) if option == "--within" else (name, "")
        if base in found:
            raise InputError(f"'{base}' is given twice", where=option)
        found[base] = float(to_si(number, suffix))
    return found


def _table(ranking: Ranking, chosen: Units, width: int) -> list[str]:
    """Return the lines of the table: what differs in columns, what is equal below."""
    from mechdae.results.tables.text import fitted_lines

    rows, equal = _alike(ranking)
    shown = {one["name"]: chosen.of(one["unit"]) for one in ranking.criteria}
    units = {name: unit.name for name, unit in shown.items()}
    same = [n for n in units if rows and len({f"{row.values[n]:.9g}" for row in rows}) == 1]
    columns = [name for name in units if name not in same]
    lines: list[str] = []
    if rows:
        judges = ["judges"] * bool(ranking.places)
        head = ["", "variant", "front", "score", *judges, *columns]
        body = [
            [str(k), row.name + equal[row.name], "*" if row.pareto else "",
             f"{ranking.score[row.name]:.4f}",
             *("..".join(dict.fromkeys(map(str, ranking.places[row.name]))) for _ in judges),
             *(f"{row.values[name] * shown[name].factor:.5g}" for name in columns)]
            for k, row in enumerate(rows[:SHOWN], 1)
        ]  # fmt: skip
        foot = ["", "", "", "", *("place" for _ in judges), *(units[name] for name in columns)]
        size = max(len(line[1]) for line in [head, *body])
        texts = [[*line[:1], line[1].ljust(size), *line[2:]] for line in [head, foot, *body]]
        given = [(column[:2], column[2:]) for column in zip(*texts, strict=True)]
        lines, _ = fitted_lines(given, range(len(texts) - 2), width, lead=2)
        if len(rows) > SHOWN:
            lines.append(f"  and {len(rows) - SHOWN} more: --json, --out")
        for name in columns:
            low, high = ranking.intervals[name]
            lines.append(
                f"  weight of {name} {ranking.weights[name]:.4g}: the first stays from "
                f"{low:.4g} to {high:.4g}"
            )
    if same:
        values = [
            f"{name} {rows[0].values[name] * shown[name].factor:.5g}"
            + (f" {units[name]}" if units[name] != "1" else "")
            for name in same
        ]
        lines.append("  equal in all: " + ", ".join(values))
    for name, lacking in ranking.missing.items():
        lines.append(
            f"  not used: {name}, {len(lacking)} variants have none to compare ({lacking[0]})"
        )
    reasons: dict[str, list[str]] = {}
    for row in ranking.rows:
        if row.why:
            reasons.setdefault(row.why, []).append(row.name)
    for why, names in list(reasons.items())[:SHOWN]:
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        lines.append(f"  not ranked: {names[0]}{more}: {why}")
    if len(reasons) > SHOWN:
        lines.append(f"  and {len(reasons) - SHOWN} other reasons: --json, --out")
    return lines


def _alike(ranking: Ranking) -> tuple[list[RankedVariant], dict[str, str]]:
    """Return the ranked variants, one for those of equal values, and how many others it is for."""
    by_name = {row.name: row for row in ranking.rows}
    alike: dict[tuple[str, ...], list[RankedVariant]] = {}
    for row in (by_name[name] for name in ranking.order):
        alike.setdefault(tuple(f"{value:.9g}" for value in row.values.values()), []).append(row)
    words = {some[0].name: f" and {len(some) - 1} equal" * (len(some) > 1)
             for some in alike.values()}  # fmt: skip
    return [some[0] for some in alike.values()], words


def _written(ranking: Ranking, folder: Path, quiet: bool) -> None:
    """Write table, JSON, problem files of the best, and pictures."""
    from mechdae.describe import whole_file

    folder.mkdir(parents=True, exist_ok=True)
    names = [criterion["name"] for criterion in ranking.criteria]
    units = [f"{criterion['name']} [{criterion['unit']}]" for criterion in ranking.criteria]
    place = {name: k for k, name in enumerate(ranking.order, 1)}
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(["variant", "place", "front", "score", *units, "why"])
    for row in sorted(ranking.rows, key=lambda ranked: place.get(ranked.name, len(place) + 1)):
        table.writerow(
            [row.name, place.get(row.name, ""), int(row.pareto), ranking.score.get(row.name, ""),
             *(row.values.get(name, "") for name in names), row.why]
        )  # fmt: skip
    texts = {"ranking.csv": out.getvalue(), "ranking.json": json.dumps(ranking.to_dict(), indent=1)}
    for name in ranking.order[:DRAWN]:
        texts[f"{name}.toml"] = ranking.variants[name].text
    for file, text in texts.items():
        with whole_file(folder / file) as stream:
            stream.write(text.encode())
        message(f"written: {folder / file}", quiet)
    for path in _pictures(ranking, folder):
        message(f"written: {path}", quiet)


def _pictures(ranking: Ranking, folder: Path) -> list[Path]:
    from mechdae.draw import save
    from mechdae.parts.types.drawn import ranking_pictures as pictures
    from mechdae.tasks.solve import solve

    written: list[Path] = []
    if not ranking.order:
        return written
    for name, draw in (("parallel", pictures.parallel), ("front", pictures.fronts)):
        try:
            figure: Any = draw(ranking)
        except InputError:  # all alike, or in all but one criterion
            continue
        written.append(save(figure, folder / f"{name}.svg"))
    results: dict[str, Any] = {}
    for name in ranking.order[:DRAWN]:
        variant = ranking.variants[name]
        assert variant.problem is not None
        results[name] = None if "spans" in variant.about else solve(variant.problem, ranking.task)
    return [*written, save(pictures.sheet(ranking, results), folder / "sheet.svg")]
