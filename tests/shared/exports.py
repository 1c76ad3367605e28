"""Exports of predefined problems, made once, and what they are compared with."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import mechdae as md
from mechdae.exchange.motion_of import ExportedMotion, motion_of


@cache
def motion(name: str) -> ExportedMotion:
    return motion_of(md.load(name), None)


def rows(name: str, count: int = 200) -> list[int]:
    """Return up to `count` assembled poses, equally spaced."""
    every = motion(name).rows
    chosen = np.unique(np.linspace(0, len(every) - 1, count).astype(int))
    return [every[k] for k in chosen]


def in_space(place: Any) -> Any:
    found = np.zeros(3)
    found[: len(place)] = place
    return found


def coordinate(result: Any, word: str, row: int) -> float:
    """Return the value of ``O.angle``, ``slot.slide``, ``body.point.x`` in a pose."""
    part, _, quantity = word.partition(".")
    if part in result.joints:
        return float(np.asarray(result.joints[part][quantity])[row])
    if quantity == "angle":
        return float(result.bodies[part].angle[row])
    point, axis = quantity.split(".")
    return float(result.points[f"{part}.{point}"].position[row]["xyz".index(axis)])
