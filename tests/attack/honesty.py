"""Draws random mechanisms, sweeps each, compares every pose with the truth, counts.

    python -m tests.attack.honesty --count 100000 --seed 0 --workers 2 --out docs/data/honesty.json

Work is done in chunks; each finished chunk is a line of OUT.parts.jsonl, and a run that was
stopped goes on from there. Where OUT holds the figures of fewer mechanisms of the same seed and
version, they are kept and the others are added. The exit code is 1 where something was wrong.

    python -m tests.attack.honesty --out docs/data/honesty.json \
        --page docs/theory/evidence/honesty.md

writes the tables of that page from the figures, and draws nothing.
"""

from __future__ import annotations

import json
import math
import sys
import time
from pathlib import Path

from tests.shared import attack

CHUNK = 50
POSES = 24
MODES_EVERY = 20
COUNTS = (
    "mechanisms", "poses", "ok", "limit", "beyond", "refused", "unsure", "not_judged",
    "raised", "stops", "misnamed", "modes",
)  # fmt: skip
BINS = 20
"""Classes of bound over error in a decade: medians are known to 6 %."""
LISTED = 40
"""Faults, errors raised and stops misnamed of which a line is kept in the figures."""


def examine(seed, family=None):
    """Return the figures of one mechanism."""
    import mechdae as md
    from tests.reference.truth.drawing import draw
    from tests.reference.truth.judging import judge, solve
    from tests.reference.truth.modes import mode_faults

    row = {"seed": seed, **dict.fromkeys(COUNTS, 0)}
    case = draw(seed, family)
    if case is None:
        return row
    row |= {"mechanisms": 1, "family": case.family, "kinds": case.kinds(), "faults": []}
    started = time.process_time()
    try:
        result = solve(case, POSES)
        row["seconds"] = time.process_time() - started
        verdict = judge(case, result)
        row["not_judged"] = int(bool(verdict.why))
        for name in ("poses", "ok", "limit", "beyond", "refused", "unsure", "stops"):
            row[name] = getattr(verdict, name)
        row["misnamed"] = len(verdict.misnamed)
        row["faults"] = verdict.faults
        row |= {"error": verdict.error, "rate": verdict.rate, "slack": verdict.slack}
        row["names"] = [text.split(" at ")[0] for text in verdict.misnamed]
        if seed % MODES_EVERY == 0:
            row["modes"] = 1
            row["faults"] = row["faults"] + mode_faults(case)
    except md.MechdaeError as error:  # it closes at its sketch, so this is a refusal
        row |= {"raised": 1, "poses": POSES, "refused": POSES, "error_text": str(error.what)}
        row.setdefault("seconds", time.process_time() - started)
    except Exception as error:
        row["faults"] = [f"{type(error).__name__}: {error}"]
        row.setdefault("seconds", time.process_time() - started)
    return row


def chunk(job):
    """Return the figures of some seeds, added up by family."""
    start, count, family = job
    families, kinds, faults, raised, named = {}, {}, [], [], []
    for seed in range(start, start + count):
        row = examine(seed, family)
        if not row["mechanisms"]:
            continue
        table = families.setdefault(
            row["family"],
            {**dict.fromkeys(COUNTS, 0), "faults": 0, "error": 0.0, "rate": 0.0,
             "slack": {}, "seconds": 0.0},
        )  # fmt: skip
        for name in COUNTS:
            table[name] += row[name]
        table["faults"] += bool(row["faults"])
        table["seconds"] += row["seconds"]
        for name in ("error", "rate"):
            table[name] = max(table[name], row.get(name, 0.0))
        if row["ok"]:
            place = str(round(BINS * math.log10(row["slack"])))
            table["slack"][place] = table["slack"].get(place, 0) + 1
        for kind in row["kinds"]:
            kinds[kind] = kinds.get(kind, 0) + 1
        entry = {"seed": seed, "family": row["family"]}
        if row["faults"]:
            faults.append({**entry, "texts": row["faults"][:3]})
        if row["raised"]:
            raised.append({**entry, "text": row["error_text"]})
        if row["misnamed"]:
            named.append({**entry, "texts": row["names"]})
    return {
        "start": start, "families": families, "kinds": kinds, "faults": faults,
        "raised": raised, "misnamed": named,
    }  # fmt: skip


def merge(parts, about):
    """Return the figures of a run from those of its chunks."""
    families, kinds = {}, {}
    lists = {"faults": [], "raised": [], "misnamed": []}
    for part in sorted(parts, key=lambda part: part["start"]):
        for name, table in part["families"].items():
            families[name] = _added(families.get(name, {}), table)
        kinds = _added(kinds, part["kinds"])
        for name, found in lists.items():
            found += part[name]
    total = {}
    for table in families.values():
        total = _added(total, table)
    for table in (*families.values(), total):
        table["error"], table["rate"] = (float(f"{table[name]:.3g}") for name in ("error", "rate"))
        table["seconds"] = round(table["seconds"], 1)
    return {
        **about,
        "total": total,
        "families": dict(sorted(families.items())),
        "kinds": dict(sorted(kinds.items())),
        **{name: found[:LISTED] for name, found in lists.items()},
    }


def _added(one, other):
    """Return the figures of two tables together."""
    result = dict(one)
    for key, value in other.items():
        known = result.get(key)
        if known is None:
            result[key] = value
        elif key in ("error", "rate"):
            result[key] = max(known, value)
        else:
            result[key] = _added(known, value) if isinstance(value, dict) else known + value
    return result


def median(classes):
    """Return the median of a table of counts by class, see `BINS`."""
    half, seen = sum(classes.values()) / 2, 0
    for place in sorted(classes, key=int):
        seen += classes[place]
        if seen >= half:
            return 10 ** (int(place) / BINS)
    return 0.0


# -- tables --------------------------------------------------------------------------------

COLUMNS = {
    "mechanisms": "mechanisms", "poses": "poses", "ok": "ok", "limit": "limit",
    "beyond": "cannot be", "refused": "refused", "unsure": "not judged", "faults": "faults",
    "error": "error / bound", "slack": "bound / error", "rate": "rate",
}  # fmt: skip


def rows(head, body):
    lines = [head, ["---"] * len(head), *body]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def tables(figures):
    """Return the tables of the page by name."""
    from tests.attack.mutants import MUTANTS

    counted = []
    for name, table in [*figures["families"].items(), ("**all**", figures["total"])]:
        counted.append([name, *[_shown(key, table[key]) for key in COLUMNS]])
    total = figures["total"]
    rest = {
        "seeds": f"{figures['seed']} to {figures['seed'] + figures['count'] - 1}",
        "poses of each": figures["poses"],
        "judged in no pose, because the truth is not sure": total["not_judged"],
        "refused with an error": total["raised"],
        "stops because the path cannot be proved further": total["stops"],
        "stops with another reason than the true one": total["misnamed"],
        "of which the modes were counted as well": total["modes"],
        "refused poses in a thousand that exist": _share(total),
        "processor time of the sweeps": f"{total['seconds']:.0f} s",
    }
    kinds = ", ".join(f"{kind} {count}" for kind, count in figures["kinds"].items())
    return {
        "figures": rows(["family", *COLUMNS.values()], counted),
        "counts": rows(["", ""], rest.items()),
        "kinds": kinds + ".",
        "mutants": rows(
            ["mutant", "planted in", "what it changes", "seen in"],
            [
                [m.name, f"`{m.place}`", m.change, ", ".join(dict.fromkeys(f for f, _ in m.cases))]
                for m in MUTANTS
            ],
        ),
    }


def _shown(key, value):
    if key == "slack":
        return f"{float(f'{median(value):.2g}'):g}"
    return f"{value:.2g}" if key in ("error", "rate") else value


def _share(total):
    there = total["ok"] + total["limit"] + total["refused"]
    return f"{1000 * total['refused'] / max(there, 1):.2f}"


def page(text, tables):
    """Return the text of a page with its tables written anew, between their marks."""
    for name, table in tables.items():
        start, end = f"<!-- {name} -->\n", "<!-- end -->"
        before, _, rest = text.partition(start)
        text = before + start + "\n" + table + "\n\n" + end + rest.partition(end)[2]
    return text


# -- runs ----------------------------------------------------------------------------------


def jobs(options, done=0):
    """Return the chunks of a run of which some first seeds are `done`."""
    last = options.seed + options.count
    return [
        (start, min(options.chunk, last - start), options.family)
        for start in range(options.seed + done, last, options.chunk)
    ]


def begun(out, about):
    """Return the figures in `out` if they are those of this run's first seeds, else None."""
    if not out.exists():
        return None
    figures = json.loads(out.read_text(encoding="utf-8"))
    same = all(figures.get(name) == value for name, value in about.items() if name != "count")
    return figures if same and figures["count"] < about["count"] else None


def parts_of(out):
    """Return the file in which the chunks of a run are kept until it is complete."""
    return out.with_name(out.name + ".parts.jsonl")


def main(arguments=None):
    parser = attack.parser(__doc__, 1000, "mechanisms")
    parser.add_argument("--family", help="draw this family alone")
    parser.add_argument("--chunk", type=int, default=CHUNK, help=f"seeds in a chunk ({CHUNK})")
    parser.add_argument("--page", type=Path, help="write the tables of this page from --out")
    options = parser.parse_args(arguments)
    if options.page:
        figures = json.loads(options.out.read_text(encoding="utf-8"))
        text = page(options.page.read_text(encoding="utf-8"), tables(figures))
        options.page.write_text(text, encoding="utf-8")
        return 0
    import mechdae as md

    about = {
        "version": md.__version__, "seed": options.seed, "count": options.count,
        "poses": POSES, "family": options.family, "chunk": options.chunk,
    }  # fmt: skip
    parts, kept, done = [], None, 0
    if options.out:
        first = begun(options.out, about)
        kept = parts_of(options.out)
        kept.parent.mkdir(parents=True, exist_ok=True)
        lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
        if lines and json.loads(lines[0]) == about:
            parts = [json.loads(line) for line in lines[1:]]
        else:
            kept.write_text(json.dumps(about) + "\n", encoding="utf-8")
        if first:
            parts.append({**first, "start": options.seed})
            done = first["count"]
    known = {part["start"] for part in parts}
    waiting = [job for job in jobs(options, done) if job[0] not in known]
    started = time.time()
    with attack.processes(options.workers) as run:
        for count, part in enumerate(run(chunk, [(job,) for job in waiting]), 1):
            parts.append(part)
            if kept:
                with kept.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(part) + "\n")
            wrong = sum(len(part["faults"]) for part in parts)
            _progress(count, len(waiting), wrong, time.time() - started)
    figures = merge(parts, about)
    code = attack.ended(figures, options.out, figures["total"].get("faults"))
    if kept:
        kept.unlink()
    return code


def _progress(done, of, faults, seconds):
    if sys.stderr.isatty() or done % 20 == 0 or done == of:
        end = "\r" if sys.stderr.isatty() and done < of else "\n"
        print(f"{done}/{of} chunks, {faults} faults, {seconds:.0f} s", end=end, file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
