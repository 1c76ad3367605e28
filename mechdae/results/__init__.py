"""Read-only arrays with names and units, the same content as the JSON."""

from typing import TYPE_CHECKING

from mechdae.additions import lazy_names
from mechdae.describe.coordinate_kinds import kind_of
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.series_units import (
    KINDS,
    OUTPUT_RATES,
    TURNS,
    UNITS,
    WEAR,
    centre_unit,
    effort_unit,
    reaction_parts,
    whole_path,
)
from mechdae.describe.units import DEGREES, SI, ShownUnit, Units, per
from mechdae.results.events import Event, events_of, motion_event
from mechdae.results.plain import plain
from mechdae.results.result import Result, SweepResult
from mechdae.results.series import LazyPart, Named, Series, Summary
from mechdae.results.shown import heads, mixed_units, shown_columns
from mechdae.results.status import CODES, FINE, LOST, Status, among, counts, statuses

if TYPE_CHECKING:
    from mechdae.results.kinds import (
        EquilibriumResult,
        ModesResult,
        MotionResult,
        ReactionsResult,
        SensitivityResult,
        StudyResult,
        SynthesisResult,
    )

__all__ = [
    "CODES", "DEGREES", "FINE", "KINDS", "LOST", "OUTPUT_RATES", "SI", "TURNS", "UNITS", "WEAR",
    "EquilibriumResult", "Event", "LazyPart", "ModesResult", "MotionResult", "Named",
    "ReactionsResult", "Result", "SensitivityResult", "Series", "ShownUnit", "Status",
    "StudyResult", "Summary", "SweepResult", "SynthesisResult", "Units", "among", "centre_unit",
    "counts", "effort_unit", "events_of", "heads", "kind_of", "mixed_units", "motion_event",
    "parameter_units", "per", "plain", "reaction_parts", "shown_columns", "statuses", "whole_path",
]  # fmt: skip
__getattr__ = lazy_names(
    {
        "mechdae.results.kinds": "EquilibriumResult ModesResult MotionResult ReactionsResult "
        "SensitivityResult StudyResult SynthesisResult"
    }
)
