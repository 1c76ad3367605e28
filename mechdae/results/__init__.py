"""Read-only arrays with names and units, the same content as the JSON."""

from mechdae.results.later import Later, Summary
from mechdae.results.plain import plain
from mechdae.results.result import Result
from mechdae.results.series import Named, Series
from mechdae.results.units import KINDS, OUTPUT_RATES, REACTION, UNITS

__all__ = [
    "KINDS",
    "OUTPUT_RATES",
    "REACTION",
    "UNITS",
    "Later",
    "Named",
    "Result",
    "Series",
    "Summary",
    "plain",
]
