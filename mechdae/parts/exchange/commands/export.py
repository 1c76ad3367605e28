"""``mechdae export P``: another program's format."""

from __future__ import annotations

import argparse
import re

from mechdae.cli.options import problem_arguments, problem_of
from mechdae.errors import InputError

PARTS = {
    "width": "of plates",
    "thickness": "of the sheet",
    "pin": "diameter of pins",
    "clearance": "of pins in their holes, radial",
    "air": "least gap of parts in one layer",
    "module": "of teeth whose number the file leaves open",
    "backlash": "of teeth, along the pitch circle, of joints without one",
    "kerf": "width of the cut (svg-cut)",
}
METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}


def _metres(name: str, text: str | None) -> float | None:
    """Return a length in metres."""
    if text is None:
        return None
    found = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(mm|cm|m|in)?\s*", text)
    if not found:
        raise InputError(f"'{text}' is not a length", where=f"--{name}", hint="such as 12mm")
    return float(found[1]) * METRES[found[2] or "mm"]


def arguments(parser: argparse.ArgumentParser) -> None:
    from mechdae.parts.exchange.formats import FORMATS

    problem_arguments(parser)
    parser.add_argument("--task", metavar="T", help="sweep, reactions or motion; the first one")
    parser.add_argument("--format", required=True, metavar="F", help=", ".join(FORMATS))
    parser.add_argument("--out", required=True, metavar="FILE", help="the file to write")
    parser.add_argument("--overwrite", action="store_true", help="in place of files that are there")
    parser.add_argument("--pose", type=int, metavar="K", help="dxf: pose that is drawn, from 0")
    parser.add_argument(
        "--tolerance",
        type=float,
        metavar="E",
        help="urdf: error of mimic polynomials aimed at, rad or share of the size (1e-6)",
    )
    parts = parser.add_argument_group(
        "stl, step and svg-cut", "lengths such as 12mm, 0.5in or 3 (mm)"
    )
    for name, about in PARTS.items():
        parts.add_argument(f"--{name}", metavar="L", help=about)
    parts.add_argument("--teeth", type=int, metavar="N", help="of the smallest wheel, likewise")


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.exchange import export
    from mechdae.parts.exchange.formats import check_format, places

    check_format(options.format)
    places(options.out, {"": ""}, options.overwrite)
    values = {"pose": options.pose, "tolerance": options.tolerance, "teeth": options.teeth}
    values |= {name: _metres(name, getattr(options, name)) for name in PARTS}
    given = {name: value for name, value in values.items() if value is not None}
    made = export(problem_of(options), options.task, format=options.format, **given)
    for path in made.save(options.out, options.overwrite):
        print(path)
    return 0
