"""``mechdae show P``."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae.cli.options import problem_arguments, problem_of
from mechdae.cli.progress import say
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.types import Json


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument(
        "--loops", action="store_true", help="as closed vector loops; --out writes them as a file"
    )
    parser.add_argument("--out", metavar="FILE", help="the problem file of --loops")


def run(options: argparse.Namespace) -> int:
    from mechdae.describe import dumps, whole_file
    from mechdae.describe.vectors.loops_of import loops_of
    from mechdae.results import plain
    from mechdae.tasks.show import loops_and_vectors, structure

    problem = problem_of(options)
    if options.out and not options.loops:
        raise InputError("only together with --loops", where="--out")
    if options.loops:
        problem = loops_of(problem)
    data = structure(problem)
    if options.loops:
        data |= loops_and_vectors(problem.mechanism)
    if options.out:
        with whole_file(Path(options.out)) as file:
            file.write(dumps(problem).encode())
    if options.json:
        print(json.dumps(plain(data), ensure_ascii=False))
    else:
        say("\n".join(_lines(data)))
    entries = [*data["formulas"], *data["tasks"].values()]
    if any("error" in entry for entry in entries):
        return 2
    return 1 if any("assembly" in entry for entry in entries) else 0


def _lines(data: dict[str, Any]) -> list[str]:
    count = data["mobility"]
    lines = [f"{data['problem']}: {data['title']}"]
    if data["source"]:
        lines.append(f"source: {data['source']}")
    if data["sizes"]:
        lines.append("sizes: " + ", ".join(f"{name} = {n}" for name, n in data["sizes"].items()))
    lines += ["", "bodies"]
    lines += [f"  {name}: points {', '.join(points)}" for name, points in data["bodies"].items()]
    lines += ["joints"]
    for name, joint in data["joints"].items():
        lines.append(f"  {name}: {joint['kind']}, {' - '.join(joint['between'])}")
    if "loops" in data:
        lines += ["", "loops", *_loops(data["loops"]), "vectors", *_vectors(data["vectors"])]
    lines += ["", "mobility"]
    words = [word for word in count if word not in ("rank", "W", "idle")]
    pairs = ", ".join(f"{word} = {count[word]}" for word in words)
    idle = count.get("idle", [])
    parts = f" = {count['W'] - len(idle)} + {len(idle)} idle" if idle else ""
    lines.append(f"  by count: W = {_counted(count)} = {count['W']}{parts}   ({pairs})")
    if idle:
        flat = "p3" not in count
        how = "turn(s) freely on a pin" if flat else "spin(s) freely between ball joints"
        lines.append(f"  idle: {', '.join(idle)} {how}")
    rank = count["rank"]
    if rank:
        lines.append(
            f"  by rank at the sketched pose: {rank['mobility']}"
            f"   ({rank['rank']} independent of {rank['equations']} equations)"
        )
        if rank["superfluous"]:
            lines.append(f"  redundant among: {', '.join(rank['superfluous'])}")
    for entry in data["formulas"]:
        lines += ["", f"driven by {', '.join(entry['drivers'])}"]
        if "formula" in entry:
            lines.append(f"  {entry['formula']}")
            lines.append(
                f"  {entry['coordinates']} coordinates -> {entry['unknowns']} unknowns"
                f" in blocks {entry['blocks']}"
            )
            for group in entry["groups"]:
                lines.append(_group(group))
        lines += [f"  {entry[word]}" for word in ("error", "assembly") if word in entry]
    lines += ["", "tasks"]
    for name, task in data["tasks"].items():
        lines.append(f"  {name}: {_task(task)}")
        lines += [f"    {text}" for text in _forces(task.get("forces", {}))]
    return lines


def _loops(loops: Json) -> list[str]:
    """Return the equations of the loops: sums of vectors that vanish."""
    sums = {
        name: " ".join(f"- {entry[1:]}" if entry[0] == "-" else f"+ {entry}" for entry in loop)
        for name, loop in loops.items()
    }
    return [f"  {name}: {text.removeprefix('+ ')} = 0" for name, text in sums.items()]


def _vectors(vectors: Json) -> list[str]:
    """Return a line for each vector: what is given, and what is sought."""
    lines = []
    for name, vector in vectors.items():
        link = "unknown" if vector["of"] in ("", name) else f"that of {vector['of']}"
        parts = []
        for word, value in vector.items():
            if word == "length":
                parts.append(f"length {'unknown' if value is None else f'{value:.6g} m'}")
            elif word != "of":
                parts.append(
                    f"{word} {link if value is None else f'{math.degrees(value):.6g} deg'}"
                )
        lines.append(f"  {name}: {', '.join(parts)}")
    return lines


def _counted(count: Json) -> str:
    """Return the formula of the mobility by count."""
    if "p" in count:  # points and equations of vectors
        return f"3*{count['n']} - {count['p']}"
    if "p1" not in count:
        return f"3*{count['n']} - 2*{count['p5']} - {count['p4']}"
    terms = [f"{k}*{count[f'p{k}']}" for k in (5, 4, 3, 2, 1) if count[f"p{k}"]]
    points = f" + 3*{count['points']}" if "points" in count else ""
    return " - ".join([f"6*{count['n']}{points}", *terms])


def _group(group: Json) -> str:
    text = f"    {group['name']}: {', '.join(group['bodies'])}; joints {', '.join(group['joints'])}"
    text += f"; order {group['order']}" if group["class"] not in ("0", "I") else ""
    return f"{text}; {_module(group['module'])}" if "module" in group else text


def _module(module: dict[str, Any]) -> str:
    """Return what of the vectors a group finds, and the loops it closes."""
    word = "module" if module["name"] else "finds"
    loops = f" by {', '.join(module['loops'])}" if module["loops"] else ""
    return f"{word} {module['text']}{loops}"


def _task(task: Json) -> str:
    if "error" in task:
        return f"{task['kind']}: {task['error']}"
    if "constraints" in task:
        return _motion(task)
    parts = [task["kind"]]
    if not task.get("available", False):
        return f"{task['kind']}, not computed by this version"
    if "free" in task:
        free = f"{len(task['free'])} free parameters: {', '.join(task['free'])}"
        parts += [f"goal {' + '.join(task['goals'])}", f"{task['starts']} starts", free]
    if "chains" in task:
        parts += [f"goal {' + '.join(task['goals'])}", " against ".join(task["objectives"])]
        parts += [f"from {', '.join(task['chains'])}", f"{task['starts']} starts of each scheme"]
    if "unknowns" not in task:
        return ", ".join(parts)
    if "poses" in task:
        parts.append(f"{task['poses']} poses")
    if "builds" in task:
        parts.append(" + ".join(task["builds"]))
    parts.append(f"{task['unknowns']} unknowns in blocks {task['blocks']}")
    if task["not_in_scene"]:
        parts.append(f"not in the scene: {', '.join(task['not_in_scene'])}")
    return ", ".join(parts)


def _motion(task: Json) -> str:
    """Return what a task of motion integrates."""
    free, constraints = len(task["coordinates"]), len(task["constraints"])
    parts = [
        f"{task['kind']}, {task['absolute']} coordinates and {task['equations']} equations "
        f"-> {free} and {constraints}",
        f"loads {', '.join(task['loads']) or 'none'}",
    ]
    if "end" in task:
        parts.insert(1, f"until t = {task['end']:g} s at tolerance {task['tolerance']:g}")
    parts += [f"laws of time for {', '.join(task['drivers'])}"] if task["drivers"] else []
    return ", ".join(parts)


def _forces(forces: dict[str, Any]) -> list[str]:
    """Return what a task of reactions builds, one kind of thing a line."""
    if not forces:
        return []
    lines = [
        f"efforts of {', '.join(forces['efforts'])}; reactions of {', '.join(forces['reactions'])}"
    ]
    loads = [f"{name} ({kind})" if kind != name else name for name, kind in forces["loads"].items()]
    lines.append(f"loads: {', '.join(loads) or 'none'}")
    if forces["direction"] != "driver":
        other = "also " if forces["direction"] == "both" else ""
        lines.append(f"resistances {other}turned round, along the motion")
    if forces["masses"]:
        slow = "; quasi-static, no speed is given" if forces["quasi_static"] else ""
        lines.append(f"masses: {', '.join(forces['masses'])}{slow}")
    if "friction" in forces:
        how = "coupled" if forces["coupled"] else "article, not fed back"
        laws: dict[str, list[str]] = {}
        for name, law in forces["friction"].items():
            laws.setdefault(law, []).append(name)
        text = "; ".join(f"{', '.join(names)}: {law}" for law, names in laws.items())
        lines.append(f"friction ({how}) {text}" if text else "friction: no joint has a coefficient")
    for word, text in (("parts", "parts of efforts and reactions"), ("axes", "reactions in axes")):
        if word in forces:
            lines.append(f"{text}: {', '.join(forces[word])}")
    if "cycle" in forces:
        lines.append("cycle: mean powers, losses, efficiency; arcs that jam or lock themselves")
    return lines
