"""Schemes of a task of composition as text: the front, what was thrown away, what was searched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mechdae.results import Result
from mechdae.results.tables.text import MOST, fact


def schemes_text(result: Result, width: int) -> list[str]:
    """Return a row for each design, the front, the census."""
    designs: Sequence[Mapping[str, Any]] = result.data.get("designs", [])
    front = result.summary.get("front", {})
    lines = _rows(result, designs) if designs else []
    if front:
        shown = [result.units.of(own["unit"]) for own in front["objectives"]]
        ends = [f"{v * u.factor:.6g}" for v, u in zip(front["reference"], shown, strict=True)]
        text = f"{len(designs)} points, hypervolume {front['hypervolume']:.6g} (SI) up to "
        lines += fact("front", f"{text}({', '.join(ends)})", width)
    summary = result.summary
    words = [f"{summary['schemes']} schemes", f"{summary['sets']} sets of dimensions measured"]
    if summary["rejected"]:
        words.append(f"{len(summary['rejected'])} thrown away by their certificate")
    lines += fact("census", ", ".join(words) + f"; seed {summary['seed']}", width)
    for entry in summary["rejected"][:MOST]:
        reasons = "; ".join(entry["reasons"])
        lines += fact("rejected", f"error {entry['objective']:.6g}: {reasons}", width)
    return lines


def _rows(result: Result, designs: Sequence[Mapping[str, Any]]) -> list[str]:
    length, angle = result.units.of("m"), result.units.of("rad")
    errors = result.units.of(result.summary["error_unit"])
    columns = [
        ("design", [str(rank) for rank in range(1, len(designs) + 1)]),
        (
            "error" if errors.name in ("", "1") else f"error [{errors.name}]",
            [f"{own['error'] * errors.factor:.5g}" for own in designs],
        ),
        (
            f"material [{length.name}]",
            [f"{own['material'] * length.factor:.5g}" for own in designs],
        ),
        ("links", [str(len(own["link_points"])) for own in designs]),
        ("joints", [str(own["joints"]) for own in designs]),
        ("points", [str(own["points"]) for own in designs]),
        (
            f"least transmission [{angle.name}]",
            [f"{own['transmission_angle_min'] * angle.factor:.3f}" for own in designs],
        ),
    ]
    if all("loss" in own for own in designs):
        power = result.units.of("W")
        losses = [f"{own['loss'] * power.factor:.5g}" for own in designs]
        columns.insert(3, (f"loss [{power.name}]", losses))
    sizes = [max(len(title), *map(len, own)) + 2 for title, own in columns]
    rows = [[title for title, _ in columns]]
    rows += [[own[k] for _, own in columns] for k in range(len(designs))]
    return ["".join(f"{cell:>{n}}" for cell, n in zip(row, sizes, strict=True)) for row in rows]


def no_facts(result: Result, width: int) -> list[str]:
    """Return nothing more to know: the table says it all."""
    return []


TEXTS = schemes_text, no_facts
"""Table, and what to know about it."""
