"""Kernels as a JavaScript module: those of the live page, which follow the path with its proofs."""

from __future__ import annotations

import json
from pathlib import Path

from mechdae.errors import UnavailableError
from mechdae.parts.page import link, live
from mechdae.parts.page import page_drivers as ways
from mechdae.parts.page.programs.javascript import NotPrintable, script
from mechdae.parts.page.programs.kernel_functions import KernelSource, head_lines, kernel_source
from mechdae.tasks import ExportedMotion
from mechdae.types import Json

TAIL = Path(__file__).with_name("mechanism.js")
"""What is put behind kernels and path: the class that is exported."""


def js(motion: ExportedMotion) -> dict[str, str]:
    """Return the files of a motion's kernels by their endings: one ES module.

    Raises
    ------
    UnavailableError
        A task that a page could only play from a record, an operation JavaScript has not.
    """
    source = kernel_source(motion)
    try:
        graphs = source.setting.graphs if source.setting.graphs.single else source.graphs
        kernels, layout = live.kernels(graphs, source.setting.scene.model, source.names, {})
    except NotPrintable as error:
        raise UnavailableError(str(error), hint="export --format c") from None
    data = json.dumps(_data(source, layout), ensure_ascii=False, allow_nan=False)
    head = "".join(f" * {line}\n".replace(" \n", "\n") for line in head_lines(source))
    text = (
        f"/*\n{head}"
        " *\n * const mechanism = new Mechanism();\n"
        " * mechanism.pose(s).values; mechanism.set({name: value});\n"
        " */\n"
        f"const DATA = {data};\n"
        f"const KERNELS = {script(kernels)};\n"
        f"{link.modules('path')}{TAIL.read_text(encoding='utf-8')}"
    )
    return {"": text}


def _data(source: KernelSource, layout: Json) -> Json:
    return {
        **_way(source),
        "whole": False,
        "speed": 1.0,
        "bounded": live.bounded_of(source.setting.outputs),
        "sliders": [{"name": n, "unit": u, "value": v} for n, u, v in source.inputs],
        "entries": source.outputs,
        "kernels": layout,
        "scene": {"dimension": source.motion.mechanism.dimension},
    }


def _way(source: KernelSource) -> Json:
    """Return the drivers, what the first pose lies on, and what the path begins with."""
    start = live.numbers_of(source.setting, source.run)
    if source.setting.graphs.single:
        way, span = ways.way_of(source.setting, source.run), list(source.range)
        return {"driver": source.drivers[0], "way": way, "range": span, "start": start}
    begin, still = [driver["value"] for driver in source.drivers], [0.0] * len(source.drivers)
    here = {"corners": [begin, begin], "largest": [1.0], "name": "", "unit": ""}
    return {
        "drivers": source.drivers,
        "way": here | {"kind": "legs", "u": begin, "rates": [still, still]},
        "range": [0.0, 0.0],
        "start": start | {"s": 0.0, "turns": False},
    }
