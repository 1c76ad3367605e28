"""What the fields of descriptions hold, in words: for docstrings and for the JSON Schema."""

from __future__ import annotations

import re
from dataclasses import MISSING, Field, fields
from inspect import cleandoc

from mechdae.describe.values import Value

USUAL = {
    "name": "name in its table: letters, digits, underscores",
    "first": "point of the first body, BODY.POINT",
    "second": "point of the second body, BODY.POINT",
    "carrier": "body that carries both wheels; without it the ground",
    "friction": "Coulomb coefficient",
    "friction_static": "coefficient of a pair at rest; without it that of friction",
    "pin_radius": "radius of the pin, which friction needs",
    "phase": "constant of the equation between the coordinates",
    "pressure_angle": "pressure angle of the teeth; of forces only",
    "mesh_loss": "share of power lost in the mesh",
    "length": "distance of the two points",
    "points": "named points in the body's frame",
    "frame": "axes of the components: world, or a body",
    "file": "CSV in the folder of the problem file, in place of rows",
    "columns": "names of the two columns of the file",
    "factor": "by which values of the table are multiplied",
    "shift": "time by which the table begins later",
    "period": "after which the table repeats",
    "periodic": "whether the table repeats outside its range",
    "interpolation": "between rows: straight lines, or a cubic spline",
    "driver": "the driven coordinate",
    "drivers": "several drivers",
    "outputs": "bodies, points, joints that the result has; without it all",
    "mode": "label of the assembly mode; absent: that of the sketch",
    "closed": "whether the curve ends where it begins",
    "goal": "what is asked for: its kind and keys",
    "min": "least value that is allowed",
    "max": "largest value that is allowed",
    "weight": "among several goals",
    "measure": "how errors of all places make one number",
    "over": "poses that count: all of a turn, or those of the goal",
    "coordinate": "coordinate that is driven",
    "body": "by its name",
    "joint": "by its name",
    "crosses": "value that is crossed",
    "direction": "sense of the crossing",
    "extreme": "largest or smallest values",
    "stiffness": "of the spring",
    "damping": "of the damper",
    "preload": "tension at the free length",
    "elevation": "in space, out of x-z",
    "azimuth": "in space, from x to z",
    **dict.fromkeys(("input_range", "output_range"), "of the coordinate while x goes over range"),
    **dict.fromkeys(("input_start", "output_start"), "where it begins; absent: free"),
    "seed": "of random starts: the same seed gives the same designs",
}
"""What fields without words of their own hold, by their names."""
NUMBER = "float or expression"
ROWS = f"of {NUMBER}"
KINDS = {
    **dict.fromkeys(("name", "text", "reference", "law"), "str"),
    **dict.fromkeys(("number", "expression"), NUMBER),
    **dict.fromkeys(("whole", "natural"), "int"),
    **dict.fromkeys(("names", "outline"), "sequence of str"),
    "numbers": f"(n,) {ROWS}", "pair": f"(2,) {ROWS}", "direction": f"(3,) {ROWS}",
    "components": f"(2,), in space (3,) {ROWS}", "moment": f"{NUMBER}, in space (3,)",
    "inertia": f"{NUMBER}, in space (3,) or (6,)", "flag": "bool",
    "points": f"dict of str to (2,), in space (3,) {ROWS}", "free": f"{NUMBER} or str",
    **dict.fromkeys(("rows", "pairs"), f"(n, 2) {ROWS}"), "lists": f"dict of str to (n,) {ROWS}",
    **dict.fromkeys(("coordinates", "start"), f"dict of str to {NUMBER}"),
    "grid": "dict of str to (from, to, count)", "freedoms": "dict of str to range",
    "driver": "Driver", "drivers": "sequence of Driver", "timetable": "TimeTable",
    "turned": "Turned", "finds": "sequence of dict", "events": "sequence of dict",
    "goals": "sequence of dict", "objectives": "sequence of dict",
    "constraints": "sequence of dict", "goal": "dict", "scheme_goal": "CurveGoal or dict",
}  # fmt: skip
"""What a field of each kind takes in Python; an expression is a text over the parameters."""


def about(entry: Field[object]) -> str:
    """Return what a field holds, with the unit of its numbers."""
    text: str = entry.metadata["doc"] or USUAL.get(entry.name, "")
    text = text or entry.name.rstrip("_").replace("_", " ")
    unit = entry.metadata["unit"]
    return f"{text} [{unit}]" if unit and unit != "1" else text


def with_parameters(cls: type[Value], text: str) -> str:
    """Return the docstring of a description with the sections that follow from its fields."""
    text = cleandoc(text)
    heading = re.search(r"\n\w+\n-{3,}\n", text)
    head, rest = (
        (text, "") if heading is None else (text[: heading.start()], text[heading.start() :])
    )
    if "\nParameters\n" not in text:
        lines = [
            line for entry in fields(cls) if "kind" in entry.metadata for line in _lines(entry)
        ]
        head = "\n".join([head.rstrip(), "", "Parameters", "----------", *lines, ""])
    if "\nRaises\n" not in text:
        wrong = "A value that the key cannot hold; the message names the key and what to try."
        head += "\n".join(["", "Raises", "------", "InputError", f"    {wrong}", ""])
    return head + rest


def _lines(entry: Field[object]) -> tuple[str, str]:
    """Return the two lines of a field: its name and type, and what it holds."""
    choices = entry.metadata["choices"]
    takes = KINDS.get(entry.metadata["kind"], "")
    if choices:
        among = "{" + ", ".join(f'"{word}"' for word in choices) + "}"
        takes = f"sequence of {among}" if takes.startswith("sequence") else among
    if entry.default is MISSING:
        default = ""
    elif entry.default is None or not isinstance(entry.default, float | int | str | tuple):
        default = ", optional"
    else:
        default = f", default {entry.default!r}"
    words = about(entry)
    words = words if re.match(r"\w+( ->|[,=(]|$)", words) else words[0].upper() + words[1:]
    return f"{entry.name} : {takes}{default}", f"    {words}."
