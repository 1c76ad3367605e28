"""Friction losses along a sweep, stacked by joint."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb

from mechdae.draw import style
from mechdae.draw.graphs.abscissa import (
    abscissa_of,
    arcs_of,
    draw_axis,
    events_of,
    key_of,
    subtitle_of,
)
from mechdae.draw.graphs.coupler import draw_polar
from mechdae.draw.graphs.frame import Entry, Panels, shaded
from mechdae.draw.graphs.scale import Scale, scale_of
from mechdae.draw.graphs.series import Array
from mechdae.draw.smooth import in_panel, smooth, thinned
from mechdae.draw.translated import translated
from mechdae.errors import InputError
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.results import ReactionsResult, SweepResult


HATCHES = ("", "//", "..", "\\\\", "--", "xx", "||")
REST = "others"
MOST = 6
"""Joints that have an area of their own; the smallest of more are added up."""
FADE = 0.62
"""Share of paper in the colour of an area."""
DASHED: dict[str, Any] = {"color": style.INK, "linewidth": 1.3, "linestyle": style.DASHED}


def draw(
    result: SweepResult, ax: Axes | None = None, *, of: Sequence[str] | None = None,
    polar: bool = False, lang: str = "en",
) -> Axes:  # fmt: skip
    """Draw the losses of all joints above each other, and their sum without feedback dashed.

    Options are those of the catalogue; without ``of`` all joints that lose power.

    Raises
    ------
    InputError
        A result without losses.
    UnknownName
        A joint that is not in the result.
    """
    if polar:
        paths = None if of is None else [f"joints/{name}/reaction" for name in of]
        return translated(draw_polar(result, ax, of=paths), lang)
    finest = _smooth(result, of)
    losses = _losses(finest, of)
    layers = _layers(losses)
    total = np.sum([layer for _, layer in layers], axis=0)
    estimate = _without_feedback(finest, losses)
    sums = [total] if estimate is None else [total, estimate]
    axis = abscissa_of(finest)
    arcs, events = arcs_of(finest, axis), events_of(result, axis)
    scale = scale_of("W", sums)
    key = key_of(axis, arcs, events)
    if estimate is not None:
        key = [Entry("all, without feedback of friction on reactions", line=DASHED), *key]
    labels = [_label(result, name) for name, _ in layers]
    frame = Panels(ax, 1, result, subtitle_of(result), key, labels)
    panel = frame.panels[0]
    ends = _areas(frame, axis.shown, scale, layers, labels)
    if estimate is not None:
        order = np.argsort(axis.shown, kind="stable")
        x, y = axis.shown[order], scale(estimate)[order]
        frame.line(panel, "loss-uncoupled", x, y, **DASHED)
    highest = max((float(np.nanmax(power, initial=0.0)) for power in sums), default=0.0)
    panel.set_ylim(0.0, float(scale(highest)) * 1.06 or 1.0)
    draw_axis(frame, axis, arcs, events)
    frame.label(panel, axis.scale.named(axis.label), scale.named("loss"))
    frame.ends(panel, ends)
    return translated(panel, lang)


def _smooth(result: SweepResult, of: Sequence[str] | None) -> Any:
    """Return a result at poses between which its losses are drawn as straight lines."""

    def seen(finer: ReactionsResult) -> list[Array]:
        x = abscissa_of(finer).values
        return [track for loss in _losses(finer, of).values() for track in in_panel(x, loss)]

    return smooth(result, seen)


def _losses(result: SweepResult, of: Sequence[str] | None) -> dict[str, Array]:
    """Return the losses of joints, without names of those that lose power."""
    names = [name for name in (of or result.joints) if "loss" in result.joints[name]]
    if not names:
        raise InputError(
            "there are no losses in this result",
            hint="a task of reactions with friction in a joint",
        )
    losses = {name: np.asarray(result.joints[name].loss, float) for name in names}
    if of is not None:
        return losses
    return {n: loss for n, loss in losses.items() if np.nanmax(loss, initial=0.0) > 0} or losses


def _without_feedback(result: Any, names: Iterable[str]) -> Array | None:
    """Return the sum of the losses of reactions that friction does not change."""
    parts = [result.joints[name] for name in names]
    free = [np.asarray(p.loss_uncoupled, float) for p in parts if "loss_uncoupled" in p]
    return np.sum(free, axis=0) if free else None


def _areas(
    frame: Panels, x: Array, scale: Scale, layers: Sequence[tuple[str, Array]],
    labels: Sequence[str],
) -> list[tuple[Array, str, str]]:  # fmt: skip
    """Draw losses above each other; return heights, label and colour of each."""
    panel, order = frame.panels[0], np.argsort(x, kind="stable")
    base, ends = np.zeros(len(x)), []
    tops = np.cumsum([layer[order] for _, layer in layers], axis=0)
    order = order[thinned(x[order], [*tops])]
    for k, ((name, layer), label) in enumerate(zip(layers, labels, strict=True)):
        top = base + layer
        color = style.color_of(k)
        lower, upper = scale(base)[order], scale(top)[order]
        area = _faded(color, FADE), _faded(color, FADE / 2), HATCHES[k % len(HATCHES)]
        panel.fill_between(x[order], lower, upper, zorder=2, gid=f"loss-{name}", **shaded(area))
        frame.line(panel, f"top-{name}", x[order], upper, color=color, linewidth=1.1, zorder=2.5)
        ends.append((scale(base + layer / 2)[order], label, color))
        base = top
    return ends


def _layers(losses: dict[str, Floats]) -> list[tuple[str, Floats]]:
    """Return losses from the largest to the smallest, the last of many added up."""
    order = sorted(losses, key=lambda name: -float(np.nansum(losses[name])))
    if len(order) <= MOST:
        return [(name, losses[name]) for name in order]
    rest = np.sum([losses[name] for name in order[MOST - 1 :]], axis=0)
    return [*((name, losses[name]) for name in order[: MOST - 1]), (REST, rest)]


def _label(result: Any, name: str) -> str:
    mean = result.summary.get("loss_by_joint", {}).get(name)
    if mean is None:
        return name
    return f"{name}, mean {scale_of('W', [mean]).text(mean, 3)}"


def _faded(color: str, share: float) -> str:
    r, g, b = share + (1 - share) * np.array(to_rgb(color))
    return to_hex((r, g, b))
