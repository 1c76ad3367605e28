"""What runs along the horizontal axis, and what is known on it: arcs, limits, change points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from mechdae.draw import style
from mechdae.draw.graphs.frame import Entry, Panels, shaded
from mechdae.draw.graphs.poles import Clip
from mechdae.draw.graphs.scale import Scale, scale_of
from mechdae.draw.graphs.series import Array, lines_of
from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.results.status import stretches
from mechdae.types import Texts

if TYPE_CHECKING:
    from mechdae.results.result import Result

Dashes = tuple[float, tuple[float, ...]]
"""Offset and lengths of dashes and gaps [widths of the line]."""
REFINED = {"jammed": "jammed_arcs", "ambiguous": "ambiguous_arcs"}
"""Statuses whose arcs a cycle locates between the poses."""
LOST = ("unassembled", "singular")
DOTS: Dashes = (0.0, (1.5, 2.0))
BEYOND: Dashes = (0.0, (1.0, 3.0))
"""Dashes of the lines where series leave the picture."""
NEAR = 0.005
"""Such places nearer to each other than that share of the abscissa are named once."""
MARKS: dict[str, tuple[str, Dashes | str]] = {
    "limit": ("limit", style.DASH_DOT),
    "end_of_curve": ("end of the curve", style.DASH_DOT),
    "stop": ("stop", style.DASH_DOT),
    "change_point": ("change point", DOTS),
    "singular": ("singular pose", DOTS),
    "stick": ("sticks", "s"),
    "slip": ("slips", ">"),
    "reversal": ("speed reverses", "D"),
    "lift_off": ("lifts off", "^"),
    "impact": ("impact", "X"),
}
"""Word of each event that is drawn; dashes of an upright line, or the mark on the axis."""
SHOWN = 4
"""Places of events that are written in the key."""
MARK: dict[str, Any] = {"linestyle": "", "markersize": 4.0}
THIN = 0.004
"""Least width of an arc, as a share of the picture."""


@dataclass(frozen=True)
class Abscissa:
    """Values of the horizontal axis; ``kind`` is driver, time, pose, or path.

    Of values in a ``window`` [its own unit] those next to its ends are there too. ``dots`` are the
    first of the poses asked for and their distance, counted in values.
    """

    kind: str
    label: str
    scale: Scale
    values: Array
    lead: int = 0
    window: tuple[float, float] | None = None
    dots: tuple[int, int] = (0, 1)

    @property
    def ends(self) -> tuple[float, float]:
        """Where the picture begins and ends [its own unit]."""
        x = self.values[np.isfinite(self.values)]
        return self.window or ((float(x.min()), float(x.max())) if x.size else (0.0, 1.0))

    @property
    def shown(self) -> Array:
        """The values in the unit shown."""
        result: Array = self.scale(self.values)
        return result

    def onward(self, values: Array) -> Array:
        """Return values of all poses from left to right, where the poses run to the left."""
        return values[::-1] if self.rises and self.values[-1] < self.values[0] else values

    @property
    def is_angle(self) -> bool:
        """Whether it is in degrees."""
        return self.scale.unit == "deg"

    @property
    def rises(self) -> bool:
        """Whether the poses follow each other along the axis, one way or the other."""
        steps = np.diff(self.values)
        return bool((steps > 0).all() or (steps < 0).all())

    def text(self, value: float, digits: int = 5) -> str:
        """Return a value with its unit, as it is shown."""
        return self.scale.text(value, digits).replace(" deg", "°" if self.is_angle else " deg")


@dataclass(frozen=True)
class StatusArc:
    """An interval of the abscissa [its own unit] and what holds there."""

    word: str
    start: float
    end: float


def abscissa_of(result: Result, against: str | None = None) -> Abscissa:
    """Return time where there is one, else the driver that moves, else the poses' numbers."""
    if against is not None:
        lines = lines_of(result, against)
        if len(lines) != 1:
            raise InputError(f"'{against}' has several components", hint=f"{against}/x")
        line = lines[0]
        scale = scale_of(line.unit, [line.values], result.units)
        return Abscissa("path", f"{line.name} {line.quantity}".strip(), scale, line.values)
    if result.time is not None:
        return Abscissa("time", "time", Scale("s"), np.asarray(result.time, float))
    moving = [name for name, driver in result.drivers.items() if np.ptp(driver.position) > 0]
    if len(moving) > 1 or not result.drivers:
        count = len(result.status)
        return Abscissa("pose", "pose", Scale(""), np.arange(count, dtype=float))
    names = list(result.drivers)
    name = moving[0] if moving else names[0]
    values = np.asarray(result.drivers[name].position, float)
    scale = scale_of(result.unit("drivers", name, "position"), [values], result.units)
    return Abscissa("driver", name, scale, values, names.index(name))


def arcs_of(result: Result, axis: Abscissa) -> list[StatusArc]:
    """Return the arcs without a plain answer, from their refined ends where the result has them.

    Elsewhere an arc reaches to a stop, or half way to the neighbouring poses.
    """
    if axis.kind == "path":
        return []
    summary = result.summary
    arcs: list[StatusArc] = []
    known = set()
    if axis.kind != "pose":
        for word, name in (*REFINED.items(), ("self-locking", "self_locking_arcs")):
            if summary.get(name):
                known.add(word)
                arcs += [StatusArc(word, *ends) for ends in summary[name]]
        for entry in summary.get("undercut", ()):
            arcs.append(StatusArc("roller undercuts", *_ends(entry, axis)))
        if axis.rises:
            arcs += _failed(result, axis)
            known.update(LOST)
    stops = [place for kind, place in events_of(result, axis) if kind == "stop"]
    for word in ("unassembled", "singular", "jammed", "ambiguous", "stopped"):
        if word not in known:
            arcs += runs(result.status, axis.values, word, stops if word == "stopped" else ())
    return arcs


def _failed(result: Result, axis: Abscissa) -> Iterator[StatusArc]:
    status, x = np.asarray(result.status), axis.values
    for entry in result.summary.get("failed", ()):
        low, high = sorted(_ends(entry, axis))
        inside = status[(x >= low) & (x <= high)]
        words = [word for word in LOST if (inside == word).any()]
        yield StatusArc(words[0] if words else "unassembled", low, high)


def _ends(entry: dict[str, Any], axis: Abscissa) -> tuple[float, float]:
    time = axis.kind == "time"
    first, last = entry["time"] if time else (_led(entry[end], axis) for end in ("from", "to"))
    return float(first), float(last)


def _led(values: Any, axis: Abscissa) -> Any:
    """Return the value of the driver along the axis, of one value for each driver."""
    every = np.ravel(values)
    return every[axis.lead if len(every) > 1 else 0]


def runs(
    status: Texts, values: Array, word: str, known: Sequence[float] = ()
) -> Iterator[StatusArc]:
    """Yield the arcs of a status, to ``known`` places or half way to the neighbours."""
    order = np.argsort(values, kind="stable")
    x, there = values[order], np.asarray(status)[order] == word

    def border(k: int) -> float:
        low, high = x[max(k - 1, 0)], x[min(k, len(x) - 1)]
        return float(next((at for at in known if low <= at <= high), (low + high) / 2))

    for first, after in stretches(there):
        yield StatusArc(word, border(first), border(after))


def subtitle_of(result: Result, *more: str) -> str:
    """Return problem, task and number of poses in one line."""
    count = len(result.status)
    poses = f"{count} poses" if count > 1 else "1 pose"
    return "  ·  ".join([result.problem, result.task, poses, *more])


def in_window(axis: Abscissa, start: float | None, end: float | None) -> tuple[Abscissa, slice]:
    """Return an abscissa from one place to another [unit shown], and its poses.

    Raises
    ------
    InputError
        The poses do not follow each other along the axis, or none is there.
    """
    low, high = axis.ends
    low = low if start is None else start / axis.scale.factor
    high = high if end is None else end / axis.scale.factor
    if not axis.rises:
        raise InputError(f"the poses do not follow each other along {axis.label}", where="from, to")
    least, most = axis.ends
    if not low < high or high <= least or low >= most:
        raise InputError(
            f"{axis.label} runs from {axis.text(least)} to {axis.text(most)}", where="from, to"
        )
    sense = np.sign(axis.values[-1] - axis.values[0])
    ends = sorted((sense * low, sense * high))
    at_start, behind = np.searchsorted(sense * axis.values, ends)
    poses = slice(max(int(at_start) - 1, 0), int(behind) + 1)
    first, step = axis.dots
    dots = ((first - poses.start) % step, step)
    return replace(axis, values=axis.values[poses], window=(low, high), dots=dots), poses


def events_of(result: Result, axis: Abscissa) -> list[tuple[str, float]]:
    """Return (kind, place) of the events that are drawn, within the picture."""
    if axis.kind in ("pose", "path") or not len(axis.values):
        return []
    found = []
    low, high = axis.ends
    slack = 1e-9 * (high - low)
    for event in result.events:
        if event["kind"] not in MARKS:
            continue
        place = event.get("time") if axis.kind == "time" else _led(event["at"], axis)
        if place is not None and low - slack <= place <= high + slack:
            found.append((event["kind"], float(place)))
    return found


def key_of(
    axis: Abscissa, arcs: Sequence[StatusArc], events: Sequence[tuple[str, float]]
) -> list[Entry]:
    """Return entries that name arcs and events once, with their places."""
    entries = []
    for word in dict.fromkeys(arc.word for arc in arcs):
        spans = [(axis.text(arc.start), axis.text(arc.end)) for arc in arcs if arc.word == word]
        where = _listed([a if a == b else f"{a} … {b}" for a, b in spans], f"{len(spans)} arcs")
        entries.append(Entry(f"{word} {where}", area=style.ARCS[word]))
    for kind in dict.fromkeys(kind for kind, _ in events):
        word, look = MARKS[kind]
        places = [axis.text(x) for event, x in events if event == kind]
        line = MARK | {"marker": look} if isinstance(look, str) else _upright(look)
        text = f"{word} {_listed([*dict.fromkeys(places)], f'{len(places)} times')}"
        entries.append(Entry(text, line=line | {"color": style.INK}))
    return entries


def _listed(places: Sequence[str], many: str) -> str:
    """Return places one by one, or how many they are."""
    return ", ".join(places) if len(places) <= SHOWN else many


def _upright(dashes: Dashes) -> dict[str, Any]:
    return {"upright": True, "linewidth": style.LINE, "linestyle": dashes}


def beyond_key(axis: Abscissa, clips: Sequence[Clip | None]) -> list[Entry]:
    """Return the entry of the key that says where series leave the picture."""
    found = [peak.at for clip in clips if clip is not None for peak in clip.beyond]
    near = NEAR * float(np.ptp(axis.values[np.isfinite(axis.values)])) if found else 0.0
    places: list[float] = []
    for at in sorted(found):
        if not places or at - places[-1] > near:  # components of one vector leave it together
            places.append(at)
    if not places:
        return []
    where = _listed([axis.text(at, 4) for at in places], f"{len(places)} places")
    line = _upright(BEYOND) | {"color": style.FAINT}
    return [Entry(f"beyond the picture {where}", line=line)]


def draw_axis(
    frame: Panels, axis: Abscissa, arcs: Sequence[StatusArc], events: list[tuple[str, float]]
) -> None:
    """Set limits and ticks, shade the arcs and draw the events in all panels."""
    low, high = sorted(float(axis.scale(value)) for value in axis.ends)
    span = high - low
    if span <= 0:
        low, high = low - 0.5, high + 0.5
    margin = 0.0 if span > 0 and axis.kind in ("driver", "time") else 0.03 * (high - low)
    for panel in frame.panels:
        panel.set_xlim(low - margin, high + margin)
        frame.turns(panel.xaxis, axis.scale, span)
        if axis.kind == "pose":
            panel.xaxis.set_major_locator(MaxNLocator(9, integer=True))
        for arc in arcs:
            start, end = sorted(float(axis.scale(value)) for value in (arc.start, arc.end))
            lack = THIN * (high - low) - (end - start)
            if lack > 0:
                start, end = start - lack / 2, end + lack / 2
            look = shaded(style.ARCS[arc.word])
            panel.axvspan(start, end, zorder=0.4, gid=f"arc-{arc.word}", **look)
        for kind, place in events:
            mark, x, gid = MARKS[kind][1], float(axis.scale(place)), f"event-{kind}"
            if not isinstance(mark, str):
                frame.upright(panel, x, mark, gid)
                continue
            more = {"transform": panel.get_xaxis_transform(), "clip_on": False, "zorder": 3.5}
            frame.line(panel, gid, [x], [0.0], marker=mark, color=style.INK, **MARK, **more)
