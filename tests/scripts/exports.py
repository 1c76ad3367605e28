"""Exports of all predefined problems, read by other programs and compared at 200 poses.

python -m tests.scripts.exports --out docs/data/exports.json [NAMES]
"""

from __future__ import annotations

import argparse
import importlib
import json
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file import library
from mechdae.parts.exchange.formats import FORMATS as REGISTERED
from mechdae.parts.exchange.robots.link_tree import link_tree
from mechdae.parts.exchange.robots.mimic import NotProved, mimics
from mechdae.parts.exchange.robots.mjcf import mjcf
from tests.shared.exports import coordinate, in_space, motion, rows

BEGIN, END = "<!-- measured -->", "<!-- end of measured -->"
FORMATS = ("dxf", "mjcf", "sdf", "urdf", "c", "js")


def closure(name: str) -> float | None:
    """Return the largest residual of MuJoCo's equalities and of sites, None with ball joints."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(mjcf(motion(name))[""])
    data = mujoco.MjData(model)
    if any(int(kind) in (0, 1) for kind in model.jnt_type):
        return None
    result, worst = motion(name).result, 0.0
    for row in rows(name):
        for j in range(model.njnt):
            value = coordinate(result, model.joint(j).name, row)
            data.qpos[model.jnt_qposadr[j]] = value
        mujoco.mj_forward(model, data)
        worst = max(worst, float(np.abs(data.efc_pos[: data.ne]).max(initial=0.0)))
        for s in range(model.nsite):
            point = model.site(s).name
            if point in result.points:
                place = in_space(result.points[point].position[row])
                if np.isfinite(place).all():
                    worst = max(worst, float(np.abs(data.site_xpos[s] - place).max()))
    return worst


def polynomials(name: str) -> dict[str, Any] | str:
    """Return degrees, proved errors, and the share of them that 200 poses show; why not."""
    own = motion(name)
    if own.setting is None or not own.setting.graphs.single:
        return "not one driver"
    words = [m.coordinate for m in link_tree(own).motions() if m.kind in ("hinge", "slide")]
    try:
        found = mimics(own, words, 1e-6, own.mechanism.scale)
    except (NotProved, md.MechdaeError) as error:
        return str(error)
    s = np.sort(np.random.default_rng(1).uniform(found.low, found.high, 200))
    poses = own.run.evaluator.at(own.run.path, s)
    columns = {
        f"{entry.part}.{entry.name}": entry.columns[0]
        for entry in own.setting.outputs.entries
        if entry.kind == "joints"
    }
    shares, errors, degrees = [], [], []
    for word, polynomial in found.polynomials.items():
        values = poses.y[0][:, columns[word]]
        real = float(np.abs(polynomial.at(s, found.low, found.high) - values).max())
        shares.append(real / polynomial.error)
        errors.append(polynomial.error)
        degrees.append(len(polynomial.coefficients) - 1)
    return {"degree": max(degrees), "error": max(errors), "share": max(shares)}


def measured(name: str) -> dict[str, Any]:
    """Return what each format says of a problem."""
    found: dict[str, Any] = {}
    try:
        motion(name)
    except md.MechdaeError as error:
        return {"motion": error.what}
    for form in FORMATS:
        module, _, function = REGISTERED[form].home.partition(":")
        try:
            getattr(importlib.import_module(module), function)(motion(name))
            found[form] = True
        except md.MechdaeError as error:
            found[form] = error.what
    if found["mjcf"] is True:
        found["closure"] = closure(name)
        found["polynomials"] = polynomials(name)
    return found


def written(table: dict[str, Any]) -> str:
    """Return the table of the page."""
    lines = [
        "| problem | closure in MuJoCo | degree | error proved | largest error at 200 values |",
        "|---|---|---|---|---|",
    ]
    for name, own in table.items():
        if own.get("mjcf") is not True:
            continue
        gap = own["closure"]
        cells = [f"`{name}`", "balls" if gap is None else f"{gap:.1e}"]
        proved = own["polynomials"]
        if isinstance(proved, dict):
            error = proved["error"]
            cells += [str(proved["degree"]), f"{error:.2e}", f"{proved['share']:.1%} of it"]
        else:
            cells += ["", proved, ""]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--page", type=Path)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    table = {}
    for name in options.names or library.names():
        problem = md.load(name)
        if not any(
            task.kind in ("sweep", "reactions", "motion") for task in problem.tasks.values()
        ):
            continue
        table[name] = measured(name)
        motion.cache_clear()
        print(name, table[name].get("closure"), table[name].get("polynomials"), flush=True)
    options.out.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    if options.page:
        before, _, rest = options.page.read_text(encoding="utf-8").partition(BEGIN)
        after = rest.partition(END)[2]
        text = f"{before}{BEGIN}\n\n{written(table)}\n{END}{after}"
        options.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
