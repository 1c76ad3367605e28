"""Mutated problem files: whatever is done to a file, the command line answers with a message.

    python -m tests.attack.mutations --count 2000 --workers 2 --out docs/data/mutations.json

Each case takes a predefined file, or one of the folder --files, changes it once to three times
(drops a key, swaps a type, adds a unit, changes a name, empties a list, puts a huge, negative, zero
or infinite number, a table in the place of a number and the other way round, ...) and runs one
command on it as a user would, inside this process. It must end with an exit code 0, 1 or 2, with a
message where that is not 0 (or a result that has the fault), without a traceback or a warning, and
within `LONGEST` seconds of CPU. A run that was broken off goes on with the same --log.
"""

from __future__ import annotations

import contextlib
import io
import json
import random
import signal
import sys
import tempfile
import threading
import time
import tomllib
import traceback
import warnings
from collections import Counter
from pathlib import Path

from tests.shared import attack
from tests.shared.paths import ROOT

PROBLEMS = ROOT / "problems"
LONGEST = 20.0
"""Seconds of CPU that a command may take on a mutated file."""
COMMANDS = ("check", "show", "solve", "solve", "solve", "solve")
SUFFIXES = ("_deg", "_rpm", "_mm", "_foo")
NUMBERS = (
    0, 0.0, -0.0, -1, 1, 2, 1e-300, 1e-30, 1e-9, 1e9, 1e30, 1e99, 1e101, 1e308, -1e9, 10**25,
    float("inf"), float("-inf"), float("nan"), 3.5, 360, 1e5, 0.1,
)  # fmt: skip
TEXTS = (
    "", "x", "omega", "1/0", "sqrt(-1)", "a.b", "crank.angle", "1e400", "t", "s", "pi", "a" * 300,
    "__import__('os')", "(" * 60 + "1" + ")" * 60, "ground.O", "ground", "sin", "2**1000000", "0/0",
    "log(0)", "exp(1000)", "ü", "\u0007", "1e9", "tan(pi/2)",
)  # fmt: skip


def bases(files=PROBLEMS):
    """Return the tables of all problem files in a folder by name, made short."""
    found = {}
    for path in sorted(Path(files).rglob("*.toml")):
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        for task in tables.get("tasks", {}).values():
            if task["kind"] == "synthesis":
                task |= {"starts": 1} | ({"keep": 3} if "objectives" in task else {})
            if task["kind"] == "composition":
                task |= {"samples": 20, "starts": 1, "grow": 0}
        found[path.stem] = tables
    return found


# -- changes -------------------------------------------------------------------------------


def places(table, path=()):
    """Return the paths of all entries, of tables and lists alike."""
    found = []
    entries = table.items() if isinstance(table, dict) else enumerate(table)
    for key, value in entries:
        found.append((*path, key))
        if isinstance(value, dict | list):
            found += places(value, (*path, key))
    return found


def at(tables, path):
    for key in path:
        tables = tables[key]
    return tables


def _drop(draw, holder, key):
    del holder[key]


def _number(draw, holder, key):
    holder[key] = draw.choice(NUMBERS)


def _scaled(draw, holder, key):
    value = holder[key]
    if isinstance(value, int | float) and not isinstance(value, bool):
        holder[key] = value * draw.choice((-1, 0.0, 10, 0.1, 1000, 1e-6, 57.29577951308232))
    else:
        holder[key] = draw.choice(NUMBERS)


def _text(draw, holder, key):
    holder[key] = draw.choice(TEXTS)


def _type(draw, holder, key):
    holder[key] = draw.choice(
        (True, False, [], {}, "", 1, -1, [1, 2], [1, 2, 3], [[]], [{}], {"a": 1}, ["x"], [True],
         [float("nan"), 0], {"coordinate": "crank.angle"})
    )  # fmt: skip


def _empty(draw, holder, key):
    value = holder[key]
    holder[key] = [] if isinstance(value, list) else {} if isinstance(value, dict) else ""


def _wrapped(draw, holder, key):
    holder[key] = draw.choice(([holder[key]], {"x": holder[key]}, [holder[key]] * 3))


def _scalar(draw, holder, key):
    value = holder[key]
    if isinstance(value, list | dict) and value:
        holder[key] = next(iter(value.values())) if isinstance(value, dict) else value[0]
    else:
        holder[key] = [value]


def _suffix(draw, holder, key):
    if isinstance(holder, dict):
        base = next((key[: -len(s)] for s in SUFFIXES if key.endswith(s)), None)
        _renamed(holder, key, base or key + draw.choice(SUFFIXES))
    else:
        holder[key] = f"{holder[key]}_deg"


def _name(draw, holder, key):
    if isinstance(holder, dict):
        others = [own for own in holder if own != key]
        new = draw.choice([f"{key}x", key[:-1], key.upper(), "kind", "2x", "a b", "", *others[:3]])
        _renamed(holder, key, new)
    elif isinstance(holder[key], str):
        holder[key] = draw.choice((holder[key] + "x", holder[key][:-1], holder[key].upper()))


def _renamed(holder, key, new):
    entries = [(new if own == key else own, value) for own, value in holder.items()]
    holder.clear()
    holder.update(entries)


def _swapped(draw, holder, key):
    """Exchange an entry with another one of the same table or list."""
    other = draw.choice(list(holder) if isinstance(holder, dict) else list(range(len(holder))))
    holder[key], holder[other] = holder[other], holder[key]


def _doubled(draw, holder, key):
    if isinstance(holder, dict):
        holder[f"{key}2"] = json.loads(json.dumps(holder[key]))
    else:
        holder.append(holder[key])


CHANGES = (
    _drop, _number, _number, _number, _scaled, _scaled, _scaled, _scaled, _text, _type, _empty,
    _wrapped, _scalar, _suffix, _name, _name, _swapped, _doubled,
)  # fmt: skip


def _gently(draw, tables):
    """Change numbers of the mechanism and of its tasks so that most files stay files."""
    told = []
    sections = ("parameters", "ground", "bodies", "joints", "sketch", "loads", "tasks", "gravity")
    numbers = [path for path in places(tables) if path[0] in sections]
    numbers = [path for path in numbers if type(at(tables, path)) in (int, float)]
    for path in draw.sample(numbers, min(len(numbers), draw.choice((1, 1, 2, 3, 6)))):
        holder, key = at(tables, path[:-1]), path[-1]
        value = holder[key]
        if isinstance(value, int) and path[0] == "tasks":
            holder[key] = draw.choice((value + 1, 2 * value, max(value // 3, 1), -value))
        else:
            factor = draw.choice((-1, 0.5, 0.9, 1.1, 2, 1 + 1e-9, 3, 10, 0.1, 0, 100, 1e-3))
            holder[key] = value * factor + draw.choice((0, 0, 0, 1e-12, 0.01, 1))
        told.append(f"{'.'.join(map(str, path))} = {holder[key]!r}")
    return told


def case(seed, tables=None):
    """Return name, text, what was changed, and the words of the command of one case.

    Every other case has other numbers alone, so that most of these are computed.
    """
    draw = random.Random(seed)
    tables = bases() if tables is None else tables
    name = draw.choice(sorted(tables))
    own = json.loads(json.dumps(tables[name]))
    told = []
    if seed % 2:
        told = _gently(draw, own)
    for _ in range(0 if told else draw.choice((1, 1, 1, 1, 2, 3))):
        whole = places(own)
        if not whole:
            break
        # sections weigh alike: expected values would else be most of all changes
        section = draw.choice(sorted({path[0] for path in whole}))
        path = draw.choice([path for path in whole if path[0] == section])
        change = draw.choice(CHANGES)
        change(draw, at(own, path[:-1]), path[-1])
        told.append(f"{change.__name__[1:]} {'.'.join(map(str, path))}")
    command = draw.choice(COMMANDS)
    words = [command]
    left = own.get("tasks") if isinstance(own.get("tasks"), dict) else {}
    kept = [task for task in tables[name].get("tasks", {}) if task in left]
    if command == "solve" and kept:
        words += ["--task", draw.choice(kept)]
    if command == "solve" and draw.random() < 0.5:
        words.append("--json")
    return name, text_of(own), told, words


# -- TOML ----------------------------------------------------------------------------------


def text_of(tables):
    """Return plain data as TOML: all in inline tables, whatever they hold."""
    return "".join(f"{_quoted(key)} = {_written(value)}\n" for key, value in tables.items())


def _quoted(text):
    return json.dumps(str(text), ensure_ascii=True).replace("\x7f", "\\u007f")


def _written(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, dict):
        inner = ", ".join(f"{_quoted(k)} = {_written(v)}" for k, v in value.items())
        return "{" + inner + "}"
    return "[" + ", ".join(map(_written, value)) + "]"


# -- running -------------------------------------------------------------------------------


def run(seed, tables=None, folder=None):
    """Return the record of one case: exit code, seconds, what is wrong with the outcome."""
    from mechdae.cli import main

    name, text, told, words = case(seed, tables)
    record = {"seed": seed, "problem": name, "changes": told, "command": " ".join(words)}
    with contextlib.ExitStack() as stack:
        if folder is None:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
        path = Path(folder) / f"{name}.toml"
        path.write_text(text, encoding="utf-8")
        for table in PROBLEMS.glob("*.csv"):
            (Path(folder) / table.name).write_bytes(table.read_bytes())
        out, err = io.StringIO(), io.StringIO()
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGALRM, _too_long)
            signal.setitimer(signal.ITIMER_REAL, 3 * LONGEST)
            stack.callback(signal.setitimer, signal.ITIMER_REAL, 0.0)
        began = time.process_time()
        fault, code = "", None
        try:
            with (
                warnings.catch_warnings(),
                contextlib.redirect_stdout(out),
                contextlib.redirect_stderr(err),
            ):
                warnings.simplefilter("error")
                code = main([words[0], str(path), *words[1:]])
        except Exception as error:
            line = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{Path(line.filename).name}:{line.lineno}"
            fault = f"{type(error).__name__} at {place}: {error}"[:300]
            record["trace"] = traceback.format_exc()
        record |= {"seconds": round(time.process_time() - began, 2), "code": code}
    if not fault:
        fault = wrong(code, out.getvalue(), err.getvalue(), words)
    if not fault and record["seconds"] > LONGEST:
        fault = f"{record['seconds']:.0f} s"
    return record | ({"fault": fault} if fault else {})


def _too_long(*_):
    """End a case that does not come to an end; it is a fault."""
    raise TimeoutError(f"no answer within {3 * LONGEST:.0f} s")


def wrong(code, out, err, words):
    """Return what is wrong with an outcome that is no traceback, empty if nothing is."""
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if "Traceback" in out + err:
        return "a traceback is printed"
    if code and not (out + err).strip():
        return f"exit code {code} without a message"
    if "--json" in words and out.strip():
        try:
            json.loads(out)
        except ValueError:
            return "no JSON object"
    return ""


def _several(seeds, files):
    tables = bases(files)
    with tempfile.TemporaryDirectory() as folder:
        return [run(seed, tables, folder) for seed in seeds]


def main(arguments=None):
    parser = attack.parser(__doc__, 200)
    parser.add_argument("--log", type=Path, help="a line for each case; its cases are not repeated")
    parser.add_argument(
        "--files", type=Path, default=PROBLEMS, help="folder of the files that are changed"
    )
    options = parser.parse_args(arguments)
    import mechdae as md

    seeds = list(range(options.seed, options.seed + options.count))
    kept = options.log.read_text(encoding="utf-8") if options.log and options.log.exists() else ""
    records = [r for r in map(json.loads, kept.splitlines()) if r["seed"] in set(seeds)]
    known = {record["seed"] for record in records}
    left = [seed for seed in seeds if seed not in known]
    chunks = [left[i : i + 10] for i in range(0, len(left), 10)]
    with attack.processes(options.workers) as run:
        for part in run(_several, [(chunk, options.files) for chunk in chunks]):
            records += part
            print(f"{len(records)} of {len(seeds)}", end="\r", file=sys.stderr, flush=True)
            if options.log:
                with options.log.open("a", encoding="utf-8") as log:
                    log.writelines(json.dumps(record) + "\n" for record in part)
    records.sort(key=lambda record: record["seed"])
    faults = [record for record in records if "fault" in record]
    figures = {
        "version": md.__version__, "seed": options.seed, "count": len(records),
        "codes": dict(sorted(Counter(str(record["code"]) for record in records).items())),
        "commands": dict(Counter(record["command"].split()[0] for record in records)),
        "faults": [{k: v for k, v in record.items() if k != "trace"} for record in faults],
        "slowest": max((record["seconds"] for record in records), default=0.0),
        "seconds": round(sum(record["seconds"] for record in records), 1),
    }  # fmt: skip
    return attack.ended(figures, options.out, faults)


if __name__ == "__main__":
    sys.exit(main())
