"""Results as tables of other packages: pandas, xarray."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Any

import numpy as np

from mechdae.describe.units import units_of
from mechdae.errors import UnavailableError
from mechdae.results.result import Result
from mechdae.results.shown import heads, shown_columns
from mechdae.types import Floats


def frame(result: Result) -> Any:
    """Return a ``pandas.DataFrame``, see `Result.frame`."""
    pandas = _extra("pandas", "frame")
    columns = shown_columns(result)
    table: dict[str, object] = {"status": np.asarray(result.status, str)}
    if result.labels:
        table["mode"] = [",".join(row) for row in result.labels]
    values = (np.asarray(array, float) for _, _, array in columns)
    name, unit, places = _along(result) or ("", "", None)
    index = None if places is None else pandas.Index(places, name=f"{name} [{unit}]")
    return pandas.DataFrame(table | dict(zip(heads(columns), values, strict=True)), index)


def dataset(result: Result) -> Any:
    """Return an ``xarray.Dataset``, see `Result.to_xarray`."""
    xarray = _extra("xarray", "to_xarray")
    name, unit, places = _along(result) or ("pose", "1", np.arange(len(result)))
    found = {
        word: (name, np.asarray(values, float), {"units": shown})
        for word, shown, values in shown_columns(result)
        if word != name
    }
    status = {"status": (name, np.asarray(result.status, str))}
    return xarray.Dataset(found | status, {name: (name, places, {"units": unit})})


def _along(result: Result) -> tuple[str, str, Floats] | None:
    """Return name, unit and values of what poses follow each other along, None of modes."""
    if result.time is not None:
        return "time", "s", np.asarray(result.time, float)
    units = units_of(result.units.asked)
    for name, series in result.drivers.items():
        if len(result) > 1 and np.ptp(series.position) > 0:
            shown = units.of(result.unit("drivers", name, "position"))
            return name, shown.name, np.asarray(series.position, float) * shown.factor
    return None


def _extra(module: str, place: str) -> ModuleType:
    """Return a module that need not be installed."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise UnavailableError(
            f"{module} is not installed",
            where=place,
            hint=f"pip install {module}, or columns() without it",
        ) from None
