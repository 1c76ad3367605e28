"""Four-links with turning and sliding pairs that lead a point past eighteen places."""

from __future__ import annotations

from matplotlib.figure import Figure

import mechdae as md

TARGETS = [
    (0.5, 1.1), (0.4, 1.1), (0.3, 1.1), (0.2, 1.0), (0.1, 0.9), (0.05, 0.75), (0.02, 0.6),
    (0.0, 0.5), (0.0, 0.4), (0.03, 0.3), (0.1, 0.25), (0.15, 0.2), (0.2, 0.3), (0.3, 0.4),
    (0.4, 0.5), (0.5, 0.7), (0.6, 0.9), (0.6, 1.0),
]  # fmt: skip
"""Twenty degrees of the crank apart."""
TASK = md.Composition(
    goal={
        "kind": "path", "closed": True, "steps": [f"{k}*pi/9" for k in range(18)],
        "targets": TARGETS,
    },
    links=[4], pairs=["R", "P"], objectives=["error", "material"], reference=[0.15, 5.0],
    samples=600, starts=6, grow=0, keep=8,
)  # fmt: skip


def figure() -> Figure:
    """Return the sheet of the designs that a task of composition finds."""
    crank = md.load("bean-curve").mechanism
    problem = md.Problem(crank, {"scheme": TASK}, title="Eighteen places, R and P")
    found = md.plot(md.synthesize(problem, "scheme"), "sheet").get_figure(root=True)
    assert isinstance(found, Figure)
    return found
