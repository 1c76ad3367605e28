"""Kernels as C: printed functions, and a short program that follows the path."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import casadi as ca
import numpy as np

from mechdae.errors import UnavailableError
from mechdae.motion.continuation.evaluate import Evaluator
from mechdae.motion.continuation.legs import SHARE
from mechdae.parts.page.live import numbers_of, slopes_of
from mechdae.parts.page.programs.javascript import (
    OPERATIONS,
    Language,
    NotPrintable,
    operations_of,
)
from mechdae.parts.page.programs.kernel_functions import KernelSource, head_lines, kernel_source
from mechdae.tasks import ExportedMotion
from mechdae.types import Graph

HEADER, CALLS, PROGRAM = (
    Path(__file__).with_name(name)
    for name in ("mechanism.h.txt", "kernels.c.txt", "follower.c.txt")
)
"""What others include, what kernels call, what follows the path: NAME is the mechanism, @WORD@
text or numbers."""
SINGLE = """
/* The same of the one driver with derivatives by its value s. */
int NAME_pose(NAME *m, double s, double *y, double *dy, double *ddy)"""
C = Language(
    "C",
    {
        code: text.replace("Math.", "").replace("===", "==").replace("!==", "!=")
        for code, text in OPERATIONS.items()
    }
    | {
        ca.OP_FABS: "fabs({0})",
        ca.OP_FMIN: "NAME_least({0},{1})",
        ca.OP_FMAX: "NAME_most({0},{1})",
        ca.OP_SIGN: "NAME_sign({0})",
        ca.OP_SQ: "NAME_sq({0})",
        ca.OP_FMOD: "fmod({0},{1})",
    },
    "static void {}(double *M) {{ (void) M;",
    "const double",
    True,
    ("NAN", "INFINITY"),
)


def c(motion: ExportedMotion) -> dict[str, str]:
    """Return the files of a motion's kernels: a C file that needs no other, and its header.

    Raises
    ------
    UnavailableError
        A task that cannot be followed by proved steps alone.
    """
    source = kernel_source(motion)
    name = re.sub(r"\W", "_", motion.problem.name)
    name = name if name[:1].isalpha() else f"m_{name}"
    rows, columns, slopes = slopes_of(source.graphs)
    functions = source.functions() | {"slopes": slopes}
    parts = _parts(source, functions) | {
        "ROWS": _row([*rows, 0]),
        "COLUMNS": _row([*columns, 0]),
        "N_SLOPES": str(len(rows)),
    }
    one = source.graphs.nu == 1
    declared = _filled(HEADER, parts | {"SINGLE": f"{SINGLE};\n" if one else ""})
    sent = " {\n  const double one = 1;\n  return NAME_track(m, &s, &one, 0, y, dy, ddy);\n}\n"
    program = _filled(
        PROGRAM, parts | {"SINGLE": SINGLE.partition("*/\n")[2] + sent if one else ""}
    )
    head = "".join(f" * {line}".rstrip() + "\n" for line in head_lines(source))
    usage = (
        " *\n * NAME m; NAME_start(&m); NAME_track(&m, u, du, ddu, y, dy, ddy);\n"
        " * C99, no library but the mathematical one; no memory but the caller's and the stack.\n"
    )
    calls = CALLS.read_text(encoding="utf-8")
    texts = {
        "": f"/*\n{head}{usage} */\n{declared}\n{calls}\n{_printed(functions)}\n{program}",
        "h": f"/* The kernel of {motion.problem.name}: its C file says what goes in and out. */\n"
        + declared,
    }
    return {ending: re.sub(r"\bNAME(?=_|\b)", name, text) for ending, text in texts.items()}


def _filled(template: Path, parts: dict[str, str]) -> str:
    """Return a template with its parts."""
    text = template.read_text(encoding="utf-8")
    return re.sub(r"@(\w+)@", lambda found: parts[found[1]], text)


def _printed(functions: dict[str, Graph]) -> str:
    """Return the functions in C, each with a call that brings its memory.

    Raises
    ------
    UnavailableError
        An operation that C has not.
    """
    texts = []
    for part, function in functions.items():
        try:
            kernel = operations_of(function, part, C)
        except NotPrintable as error:
            raise UnavailableError(str(error), hint="export --format js") from None
        text, size = kernel.text(f"NAME_{part}_kernel", C)
        sizes = [count for _, count in kernel.inputs] + [-1] + [n for _, n in kernel.outputs] + [-1]
        texts.append(
            f"{text}static void NAME_call_{part}(const double *const *given, "
            "double *const *found) {\n"
            f"  static const int size[] = {{{_row(sizes)}}};\n  double M[{size + 1}];\n"
            f"  NAME_run(NAME_{part}_kernel, size, M, given, found);\n}}\n"
        )
    return "\n".join(texts)


def _parts(source: KernelSource, functions: dict[str, Graph]) -> dict[str, str]:
    """Return what stands in the templates."""
    graphs, setting = source.graphs, source.setting
    start, poses = numbers_of(setting, source.run), Evaluator(graphs, setting.outputs)
    columns, rows = graphs.units(start["scale"], graphs.scene.model.p_values)
    adjugate = [graphs.blocks[b].rows if b in graphs.adjugates else 0 for b in range(graphs.nb)]
    units = [float(np.prod(r) / np.prod(c)) for r, c in zip(rows, columns, strict=True)]
    far = [1e300 if value is None else value for value in start["far"]]
    counts = {
        "N_THETA": len(source.inputs),
        "N_U": graphs.nu,
        "N_Y": graphs.ny,
        "N_X": graphs.nx,
        "N_BLOCKS": graphs.nb,
        "N_P": functions["numbers"].numel_out(0),
    }
    numbers: dict[str, Iterable[float]] = {
        "THETA": [value for _, _, value in source.inputs],
        "X0": start["x"],
        "SIZE_X": start["size_x"],
        "FAR": far,
        "ANGLE": poses.angles.astype(int),
        "LENGTHS": poses.lengths.astype(int),
        "TURNING": poses.turning.astype(int),
        "TELLS": poses.sign_tells.astype(int),
        "ADJUGATE": adjugate,
        "DET": units,
    }
    return {
        "SIZES": "".join(f"#define NAME_{part} {count}\n" for part, count in counts.items()),
        "U0": _row(driver["value"] for driver in source.drivers),
        "UNIT_U": _row(driver["size"] for driver in source.drivers),
        "SIZE_U": _row(start["size_u"]),
        "SCALE": repr(float(start["scale"])),
        "LARGEST": repr(SHARE),
        **{part: _row([*values, 0]) for part, values in numbers.items()},
    }


def _row(values: Iterable[float]) -> str:
    return ", ".join(repr(int(v) if v == int(v) and abs(v) < 1e9 else float(v)) for v in values)
