"""Schemes of a task of composition as text: the front, what was thrown away, what was searched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mechdae.results import Result
from mechdae.results.tables.designs import fitted_columns, front_facts, no_facts
from mechdae.results.tables.text import MOST, fact


def schemes_text(result: Result, width: int) -> list[str]:
    """Return a row for each design, the front, the census."""
    designs: Sequence[Mapping[str, Any]] = result.data.get("designs", [])
    lines = _rows(result, designs, width) if designs else []
    lines += front_facts(result, width)
    summary = result.summary
    words = [f"{summary['schemes']} schemes", f"{summary['sets']} sets of dimensions measured"]
    if summary["rejected"]:
        words.append(f"{len(summary['rejected'])} thrown away by their certificate")
    lines += fact("census", ", ".join(words) + f"; seed {summary['seed']}", width)
    for entry in summary["rejected"][:MOST]:
        reasons = "; ".join(entry["reasons"])
        lines += fact("rejected", f"error {entry['objective']:.6g}: {reasons}", width)
    return lines


def _rows(result: Result, designs: Sequence[Mapping[str, Any]], width: int) -> list[str]:
    length, angle = result.units.of("m"), result.units.of("rad")
    errors = result.units.of(result.summary["error_unit"])
    columns = [
        ("design", [str(rank) for rank in range(1, len(designs) + 1)]),
        (
            "error" if errors.name in ("", "1") else f"error [{errors.name}]",
            [f"{design['error'] * errors.factor:.5g}" for design in designs],
        ),
        (
            f"material [{length.name}]",
            [f"{design['material'] * length.factor:.5g}" for design in designs],
        ),
        ("links", [str(len(design["link_points"])) for design in designs]),
        ("joints", [str(design["joints"]) for design in designs]),
        ("points", [str(design["points"]) for design in designs]),
        (
            f"least transmission [{angle.name}]",
            [f"{design['transmission_angle_min'] * angle.factor:.3f}" for design in designs],
        ),
    ]
    if all("loss" in design for design in designs):
        power = result.units.of("W")
        losses = [f"{design['loss'] * power.factor:.5g}" for design in designs]
        columns.insert(3, (f"loss [{power.name}]", losses))
    return fitted_columns(columns, width)


TEXTS = schemes_text, no_facts
"""Table, and what to know about it."""
