"""Kernels as C: the functions printed by casadi, and a short program that follows the path."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import casadi as ca

from mechdae.errors import UnavailableError
from mechdae.parts.page.programs.kernel_functions import KernelSource, head_lines, kernel_source
from mechdae.tasks import ExportedMotion
from mechdae.types import Graph

FUNCTIONS = ("numbers", "constants", "advance", "pose")
PROGRAM = Path(__file__).with_name("follower.c.txt")
"""What follows the path; NAME stands for the mechanism, @WORD@ for numbers."""


def c(motion: ExportedMotion) -> dict[str, str]:
    """Return the files of a motion's kernels by their endings: one C file without a library.

    Raises
    ------
    InputError
        A task without one driver.
    UnavailableError
        A task that cannot be followed by proved steps alone.
    """
    source = kernel_source(motion)
    if not source.setting.graphs.nx:
        raise UnavailableError(
            "nothing is left to be solved: all follows from the driver by formulas",
            where=f"tasks.{motion.task}",
            hint="export --format js",
        )
    name = re.sub(r"\W", "_", motion.problem.name)
    name = name if name[:1].isalpha() else f"m_{name}"
    functions = source.functions(FUNCTIONS)
    head = "".join(f" * {line}".rstrip() + "\n" for line in head_lines(source))
    usage = (
        f" *\n * {name} m; {name}_start(&m);\n"
        f" * {name}_pose(&m, s, y, dy, ddy); {name}_set(&m, theta);\n"
        " * Each returns 0 where the pose is proved. C99, no library but the mathematical one.\n"
    )
    printed = _printed(functions, name)
    text = f"/*\n{head}{usage} */\n{_sizes(source, functions, name)}\n{printed}\n"
    return {"": text + _program(source, name)}


def _printed(functions: dict[str, Graph], name: str) -> str:
    """Return the functions in C, each with a call that brings its work vectors."""
    generator = ca.CodeGenerator(f"{name}.c", {"with_header": False, "casadi_int": "long long int"})
    for part, function in functions.items():
        given = function.sx_in()
        generator.add(ca.Function(f"{name}_{part}_kernel", given, function.call(given)))
    text = str(generator.dump())
    calls = []
    for part, function in functions.items():
        kernel = f"{name}_{part}_kernel"
        calls.append(
            f"static void {name}_call_{part}(const double **given, double **found) {{\n"
            f"  const double *arg[{function.sz_arg()}];\n  double *res[{function.sz_res()}];\n"
            f"  casadi_int iw[{function.sz_iw() + 1}];\n"
            f"  double w[{function.sz_w() + 1}];\n  int i;\n"
            f"  for (i = 0; i < {function.n_in()}; i++) arg[i] = given[i];\n"
            f"  for (i = 0; i < {function.n_out()}; i++) res[i] = found[i];\n"
            f"  {kernel}(arg, res, iw, w, 0);\n}}\n"
        )
    return text + "\n" + "\n".join(calls)


def _sizes(source: KernelSource, functions: dict[str, Graph], name: str) -> str:
    graphs = source.setting.graphs
    counts = {
        "N_THETA": len(source.inputs),
        "N_Y": functions["pose"].numel_out(5),
        "N_X": graphs.nx,
        "N_BLOCKS": graphs.nb,
        "N_P": functions["numbers"].numel_out(0),
    }
    return "".join(f"#define {name}_{word} {count}\n" for word, count in counts.items())


def _program(source: KernelSource, name: str) -> str:
    start = source.start
    far = [1e300 if value is None else value for value in start["far"]]
    parts = {
        "THETA": _row([*[value for _, _, value in source.inputs], 0.0]),
        "X0": _row(start["x"]),
        "SIZE_X": _row(start["size_x"]),
        "FAR": _row(far),
        "S0": repr(float(start["s"])),
        "LARGEST": repr(float(start["largest"])),
        "SIZE_U": repr(float(start["size_u"][0])),
        "SCALE": repr(float(start["scale"])),
    }
    text = re.sub(r"@(\w+)@", lambda found: parts[found[1]], PROGRAM.read_text(encoding="utf-8"))
    return re.sub(r"\bNAME(?=_|\b)", name, text)


def _row(values: Iterable[float]) -> str:
    return ", ".join(repr(float(value)) for value in values)
