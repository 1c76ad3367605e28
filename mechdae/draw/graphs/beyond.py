"""The entry of a key that says where series leave the picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.draw import style
from mechdae.draw.graphs.abscissa import SHOWN, Abscissa
from mechdae.draw.graphs.frame import Entry
from mechdae.draw.graphs.poles import Clip

DASH = (0.0, (1.0, 3.0))
"""Dashes of the lines at these places."""
NEAR = 0.005
"""Places nearer to each other than that share of the abscissa are named once."""


def beyond_key(axis: Abscissa, clips: Sequence[Clip | None]) -> list[Entry]:
    """Return the entry of the key that says where series leave the picture."""
    found = [own.at for clip in clips if clip is not None for own in clip.beyond]
    near = NEAR * float(np.ptp(axis.values[np.isfinite(axis.values)])) if found else 0.0
    places: list[float] = []
    for at in sorted(found):
        if not places or at - places[-1] > near:  # components of one vector leave it together
            places.append(at)
    if not places:
        return []
    where = ", ".join(axis.text(at, 4) for at in places)
    where = where if len(places) <= SHOWN else f"{len(places)} places"
    line = {"upright": True, "color": style.FAINT, "linewidth": style.LINE, "linestyle": DASH}
    return [Entry(f"beyond the picture {where}", line=line)]
