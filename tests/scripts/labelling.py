"""Counts what the labels of diagrams cover: predefined problems and random mechanisms.

    python -m tests.scripts.labelling --count 500 --seed 0 --out docs/data/labels.json
    python -m tests.scripts.labelling --out docs/data/labels.json --page PAGE

A label is the ink of a letter, or the disc of a number. It covers another label where the two
have a common area; a link or a symbol where a line of it, with its width, or its area comes
into the label; the sheet's border where it leaves it. Thin paths of points do not count.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from unittest import mock

import numpy as np

from tests.shared import attack

POSES = 25
HALF = 1.2
"""Half the width of a link's line, in units of the sheet; other lines are thinner."""
COUNTS = (
    "labels", "labels_on_labels", "labels_on_lines", "labels_on_symbols", "labels_outside",
    "leaders", "leaders_on_labels",
)  # fmt: skip


def drawn(result, **options):
    """Draw a diagram; return the lines, boxes and labels of its sheet, and the sheet."""
    import mechdae as md
    from mechdae.draw.diagram import diagram
    from mechdae.draw.labels.labels import write_all

    seen = []

    def spy(sheet, *rest):
        before = (list(sheet.segments), list(sheet.boxes))
        seen.append((*before, write_all(sheet, *rest), sheet))
        return seen[0][2]

    with mock.patch.object(diagram, "write_all", spy):
        md.plot(result, "diagram", **options)
    return seen[0]


def count(result, **options):
    """Return how many labels of a diagram cover what, with the names of those that do."""
    from mechdae.draw import style
    from mechdae.draw.labels.labels import AIR

    segments, boxes, labels, sheet = drawn(result, **options)
    row = {**dict.fromkeys(COUNTS, 0), "names": []}
    if not labels:
        return row
    ink = np.array([DISC_AIR if gid.startswith("number-") else AIR for gid, _, _ in labels])
    low = np.array([label[1] for label in labels]) + ink[:, None]
    high = np.array([label[2] for label in labels]) - ink[:, None]
    shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    each = (shared > 1e-9).all(axis=-1)
    np.fill_diagonal(each, False)
    lines = np.array([line for line in segments if line[4] >= style.RING]).reshape(-1, 5)
    areas = np.array([box for box in boxes if box[4] >= style.RING]).reshape(-1, 5)
    near = np.array(
        [
            (_distance(lines, a, b, gid.startswith("number-")) < HALF - 1e-9).any()
            for gid, a, b in zip([label[0] for label in labels], low, high, strict=True)
        ]
    )
    inside = (
        (np.minimum(high[:, None], areas[:, 2:4]) - np.maximum(low[:, None], areas[:, :2])) > 1e-9
    ).all(axis=-1)
    outside = (low < 0).any(axis=1) | (high > sheet.size).any(axis=1)
    row["labels"] = len(labels)
    row["labels_on_labels"] = int(each.sum()) // 2
    row["labels_on_lines"] = int(near.sum())
    row["labels_on_symbols"] = int(inside.any(axis=1).sum())
    row["labels_outside"] = int(outside.sum())
    leaders = {
        line.get_gid().removeprefix("leader-"): sheet.at(line.get_xydata())
        for line in sheet.ax.lines
        if str(line.get_gid()).startswith("leader-")
    }
    row["leaders"] = len(leaders)
    for k, (gid, _, _) in enumerate(labels):
        others = [(*a, *b, 0.0) for name, (a, b) in leaders.items() if name != gid]
        through = _distance(np.array(others).reshape(-1, 5), low[k], high[k], "number-" in gid)
        row["leaders_on_labels"] += int((through <= 0.0).sum())
    bad = each.any(axis=1) | near | inside.any(axis=1) | outside
    row["names"] = [gid for (gid, _, _), wrong in zip(labels, bad, strict=True) if wrong]
    return row


DISC_AIR = 1.2
"""Room that a number's box has around its disc with its line."""


def _distance(lines, low, high, disc):
    """Return how far each line is from a box, or from the disc in it; 0 inside."""
    start, end = lines[:, 0:2], lines[:, 2:4]
    shares = np.linspace(0.0, 1.0, 65)[:, None, None]
    spots = start + shares * (end - start)  # finer than the lines are wide, for lines near by
    if disc:
        middle, radius = (low + high) / 2, float(high[0] - low[0]) / 2
        step = end - start
        length = (step**2).sum(axis=1)
        share = ((middle - start) * step).sum(axis=1) / np.where(length > 0, length, 1.0)
        foot = start + np.clip(share, 0.0, 1.0)[:, None] * step
        return np.maximum(np.hypot(*(foot - middle).T) - radius, 0.0)
    gaps = np.maximum(np.maximum(low - spots, spots - high), 0.0)
    return np.hypot(gaps[..., 0], gaps[..., 1]).min(axis=0)


def problems(poses=POSES):
    """Yield the name and the count of each predefined problem, of one task with poses."""
    import mechdae as md
    from mechdae.describe.file.library import names

    for name in names():
        problem = md.load(name)
        tasks = problem.tasks
        chosen = [key for key, task in tasks.items() if task.kind == "sweep"]
        chosen += [key for key, task in tasks.items() if task.kind in ("reactions", "modes")]
        chosen += [key for key, task in tasks.items() if task.kind == "motion"]
        if not chosen:  # a synthesis alone: the mechanism it starts from, from its sketch on
            driver = next(iter(tasks.values())).driver.coordinate
            sweep = md.Sweep(md.Driver(driver, from_=1.0, to=1.0 + 2 * np.pi), poses=poses)
            yield name, count(md.solve(problem, sweep))
            continue
        from_to = chosen and getattr(tasks[chosen[0]], "poses", None) is not None
        yield name, count(md.solve(problem, chosen[0], **({"poses": poses} if from_to else {})))


def random_one(seed):
    """Return the count of one random mechanism, None where none was drawn or solved."""
    import mechdae as md
    from tests.reference.truth.drawing import draw
    from tests.reference.truth.judging import solve

    case = draw(seed)
    if case is None:
        return None
    try:
        result = solve(case, POSES)
    except md.MechdaeError:
        return None
    return {**count(result), "family": case.family, "bodies": len(case.bodies)}


def total(rows):
    """Add up counts."""
    return {
        "diagrams": len(rows),
        **{name: sum(row[name] for row in rows) for name in COUNTS},
        "diagrams_clean": sum(not row["names"] for row in rows),
    }


MARK = "<!-- labels -->"


def table(figures):
    """Return the figures as the table of the documentation."""
    words = {
        "diagrams": "diagrams",
        "labels": "labels",
        "labels_on_labels": "pairs of labels that overlap",
        "labels_on_lines": "labels on a line of a link or symbol",
        "labels_on_symbols": "labels on the area of a symbol",
        "labels_outside": "labels that leave the sheet",
        "diagrams_clean": "diagrams without any of these",
        "leaders": "thin lines to labels farther off",
        "leaders_on_labels": "of these through another label",
    }
    rows = ["| | predefined problems | random mechanisms |", "|---|---|---|"]
    rows += [
        f"| {text} | {figures['problems'][name]} | {figures['random'][name]} |"
        for name, text in words.items()
    ]
    return "\n".join(rows) + "\n"


def paged(text, figures):
    """Return a page with the table behind its mark; what follows the table stays."""
    head, tail = text.split(MARK)
    rest = tail.lstrip("\n").splitlines(keepends=True)
    while rest and rest[0].startswith("|"):
        del rest[0]
    return f"{head}{MARK}\n\n{table(figures)}{''.join(rest)}"


def main(argv=None):
    """Run the command line and return its exit code."""
    parser = attack.parser(__doc__, 500, "random mechanisms")
    parser.add_argument("--no-problems", action="store_true")
    parser.add_argument("--page", type=Path, help="write the table of OUT into it, draw nothing")
    options = parser.parse_args(argv)
    if options.page:
        text = options.page.read_text(encoding="utf-8")
        figures = json.loads(options.out.read_text(encoding="utf-8"))
        options.page.write_text(paged(text, figures), encoding="utf-8")
        return 0
    known = [] if options.no_problems else list(problems())
    rows, seed = [], options.seed
    while len(rows) < options.count:
        row = random_one(seed)
        if row is not None:
            rows.append({**row, "seed": seed})
        seed += 1
    figures = {
        "problems": total([row for _, row in known]),
        "random": {"first_seed": options.seed, **total(rows)},
        "covered": {
            "problems": {name: row["names"] for name, row in known if row["names"]},
            "random": [
                {"seed": row["seed"], "family": row["family"], "names": row["names"]}
                for row in rows
                if row["names"]
            ],
        },
    }
    return attack.ended(figures, options.out, False)


if __name__ == "__main__":
    sys.exit(main())
