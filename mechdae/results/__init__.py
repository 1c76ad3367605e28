"""Read-only arrays with names and units, the same content as the JSON."""

from mechdae.results.events import Event, events_of
from mechdae.results.kinds import (
    EquilibriumResult,
    ModesResult,
    MotionResult,
    ReactionsResult,
    SensitivityResult,
    StudyResult,
    SweepResult,
    SynthesisResult,
)
from mechdae.results.later import Later, Summary
from mechdae.results.plain import plain
from mechdae.results.result import Result, whole_path
from mechdae.results.series import Named, Series
from mechdae.results.shown import heads, shown_columns
from mechdae.results.status import CODES, FINE, LOST, Status, among, counts, statuses
from mechdae.results.units import KINDS, OUTPUT_RATES, UNITS, effort_unit, reaction_parts

__all__ = [
    "CODES",
    "FINE",
    "KINDS",
    "LOST",
    "OUTPUT_RATES",
    "UNITS",
    "EquilibriumResult",
    "Event",
    "Later",
    "ModesResult",
    "MotionResult",
    "Named",
    "ReactionsResult",
    "Result",
    "SensitivityResult",
    "Series",
    "Status",
    "StudyResult",
    "Summary",
    "SweepResult",
    "SynthesisResult",
    "among",
    "counts",
    "effort_unit",
    "events_of",
    "heads",
    "plain",
    "reaction_parts",
    "shown_columns",
    "statuses",
    "whole_path",
]
