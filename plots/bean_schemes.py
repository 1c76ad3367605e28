"""Four-bars that trace a bean, with more and with less material."""

from __future__ import annotations

from matplotlib.figure import Figure

import mechdae as md


def figure() -> Figure:
    """Return the sheet of the designs that a task of composition finds."""
    result = md.synthesize("bean-curve", "scheme")
    found = md.plot(result, "sheet").get_figure(root=True)
    assert isinstance(found, Figure)
    return found
