"""Collects what a page needs and writes it as one file."""

from __future__ import annotations

import html
import tomllib
from collections.abc import Mapping
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.describe import Mechanism, Problem, Sweep, Task, dumps, whole_file
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.load import Source, given
from mechdae.describe.file.reading import split_keys
from mechdae.describe.tasks.motion import Reactions
from mechdae.describe.units import SI, Units, units_of
from mechdae.describe.values import Number
from mechdae.draw.smooth import in_picture, smooth
from mechdae.draw.words import table
from mechdae.errors import InputError, MechdaeError
from mechdae.forces.poses import LoadedRun, loaded_run
from mechdae.motion.kinematics.prepared import Run, Setting, prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run as followed
from mechdae.parts.page import efforts, lesson, link, live, scenes
from mechdae.parts.page import page_drivers as ways
from mechdae.parts.page.programs.javascript import NotPrintable, tables
from mechdae.records import dataclass, public
from mechdae.results import Result, plain
from mechdae.tasks.solve import solve
from mechdae.types import Floats, Json

CHECKS = 12
"""Poses at which the page compares itself with Python when it is opened."""
MOST_RECORDED, FEW = 720, 25
"""Poses that are recorded, of a page that cannot solve, and of one that can."""
MOST_PAGES = 8
"""Pages that are not built again when they are wanted again."""
KINDS = ("sweep", "reactions", "motion")
"""Kinds of tasks that have a page, the first one of a problem is the usual one."""
LANGUAGES = ("en", "ru")


@dataclass(frozen=True, repr=False)
class Page:
    """A page as text.

    Attributes
    ----------
    html
        The whole file.
    data
        What its element ``mechdae`` holds.

    Examples
    --------
    >>> md.page(md.four_bar(0.1, 0.04, 0.12, 0.08))
    <Page four-bar / turn: live>
    """

    html: str
    data: Mapping[str, Any]

    def save(self, path: str | FilePath) -> FilePath:
        """Write the file, whole or not at all, and return its path."""
        target = FilePath(path)
        with whole_file(target) as file:
            file.write(self.html.encode())
        return target

    def __repr__(self) -> str:
        """Return one line: problem, task, live or why it is recorded."""
        kind = "live" if self.data["live"] else self.data["reason"]
        return f"<Page {self.data['problem']} / {self.data['task']}: {kind}>"

    def _repr_html_(self) -> str:
        """Return the page in a frame of its own, for notebooks."""
        return (
            f'<iframe srcdoc="{html.escape(self.html, quote=True)}" width="100%" height="640" '
            'style="border:0" sandbox="allow-scripts allow-downloads"></iframe>'
        )


@public(old="problem task lang units")
def page(
    problem: Source,
    task: Task | str | None = None,
    *,
    set: Mapping[str, Number] | None = None,
    lang: str = "en",
    units: str | Units = SI,
) -> Page:
    """Return the live page of a task.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        Name of a sweep, reactions or motion task; the first one without a name.
    set
        Numbers to change, as of `md.solve`.
    lang
        Language of its words, "en" or "ru".
    units
        What it shows numbers in, such as ``"mm,deg,kN"``; its files and interface stay SI.

    Returns
    -------
    Page
        One HTML file that needs no other; ``save`` writes it.

    Raises
    ------
    InputError
        A task without poses along a path, a language that it does not speak, no units.
    SolveError
        The mechanism does not assemble.

    Examples
    --------
    >>> page = md.page(md.four_bar(0.1, 0.04, 0.12, 0.08))
    >>> page.html[:15]
    '<!doctype html>'
    """
    if lang not in LANGUAGES:
        raise InputError(f"no words in '{lang}'", where="lang", hint=", ".join(LANGUAGES))
    if isinstance(problem, Result):
        units = units or problem.units
        if task is None:
            _check_again(problem)
    whole, name = given(problem, task, set)
    if name is None:
        able = [name for name, kind in whole.tasks.items() if kind.kind in KINDS]
        if not able:
            raise InputError("no task with poses along a path", where="tasks", hint="kind = sweep")
        live = [name for name in able if whole.task(name).kind != "motion"]
        name = able[0]
        if name in live:  # one over an interval before one of a few poses
            name = max(live, key=lambda name: whole.task(name).way)
    chosen = whole.task(name)
    if chosen.kind not in KINDS:
        raise InputError(
            f"a page shows {', '.join(KINDS)}, not {chosen.kind}", where=f"tasks.{name}"
        )
    names = (units if isinstance(units, Units) else units_of(units)).asked
    return _page(whole, name, lang, names, dumps(whole))


def _check_again(result: Result) -> None:
    """Raise for a result whose task has no live page: one driver has to move."""
    moving = [name for name, driver in result.drivers.items() if np.ptp(driver.position) > 0]
    if len(moving) != 1 or result.kind not in KINDS[:2] or result.time is not None:
        raise InputError(
            "a page of a result needs one driver that moves", hint="md.page(problem, task)"
        )


@dataclass
class _Followed:
    """A task as it is shown: its motion, and what acts along it."""

    task: Any
    result: Result
    setting: Setting | None = None
    run: Run | None = None
    loaded: LoadedRun | None = None
    without: str = ""


def _followed(problem: Problem, name: str, lang: str) -> _Followed:
    """Follow a task's motion, with all bodies where they assemble."""
    task = problem.task(name)
    loaded, without = _loaded(problem, task, lang) if isinstance(task, Reactions) else (None, "")
    if isinstance(task, Reactions):
        task = Sweep(**{field.name: getattr(task, field.name) for field in fields(Sweep)})
    if not (isinstance(task, Sweep) and task.kind == "sweep"):
        return _Followed(task, solve(problem, name))
    changed = problem.with_task(name, task)
    task = replace(task, outputs=None, measures=None)
    problem = problem.with_task(name, task)
    try:
        if loaded is not None:
            setting, run = loaded.setting, loaded.run
        else:
            setting = prepare(problem, task)
            run = followed(setting, task)
        result = report(problem, name, task, setting, run)
    except MechdaeError:  # what the task does not ask for may not assemble
        return _Followed(task, solve(changed, name))
    return _Followed(task, result, setting, run, loaded, without)


def _loaded(problem: Problem, task: Reactions, lang: str) -> tuple[LoadedRun | None, str]:
    """Return a task's run with its forces, or why they are not shown."""
    if problem.mechanism.dimension == 3:
        return None, link.said("space", lang)
    task = replace(task, outputs=None, measures=None)
    try:
        found = loaded_run(problem, task)
        reason = link.said(efforts.why_without(found.statics), lang)
    except MechdaeError as error:
        return None, error.what
    return (None, reason) if reason else (found, "")


@lru_cache(maxsize=MOST_PAGES)
def _page(problem: Problem, name: str, lang: str, names: tuple[str, ...], file: str) -> Page:
    units, found = units_of(names, problem.mechanism.units), _followed(problem, name, lang)
    setting, run, result, task = found.setting, found.run, found.result, found.task
    reason = link.said(live.why_recorded(setting, run, task), lang, kind=getattr(task, "kind", ""))
    data: Json = {
        "schema": 1,
        "version": __version__,
        "title": problem.title or problem.name,
        "problem": problem.name,
        "task": name,
        "source": problem.source,
        "lang": lang,
        "file": file,
        "numbers": plain(problem.mechanism.values()),
        "live": not reason,
        "reason": reason,
        "kernels": None,
        "forces": None,
        "without": found.without,
        "units": parameter_units(problem.mechanism, problem.tasks.values()),
    }
    if lang == "ru":
        data["unit_names"] = {**table("units"), " ": "·"}
    if units:
        data["shown"] = {si: [shown.factor, shown.name] for si, shown in units.by_si.items()}
    kernels: Json | None = None
    if setting is not None and run is not None and not reason:
        try:
            kernels = _make_live(data, problem, setting, run, found)
        except NotPrintable as error:
            data |= {"live": False, "reason": str(error)}
    if not data["live"] and isinstance(task, Sweep) and result.status.size > MOST_RECORDED:
        data["reason"] += link.said("poses", lang, some=MOST_RECORDED, all=result.status.size)
    if not data["live"]:
        result = smooth(result, _ways)
    shown: Json = {"driver": _driver(result), "status": [str(own) for own in result.status]}
    data = shown | data  # of several drivers it has its own
    values = data["driver"]["values"] if data["live"] else range(len(result.status))
    seen, places = result, np.asarray(values, float)
    driver = getattr(task, "driver", None)
    if data["live"] and len(places) == 1 and driver is not None:  # the page shows all of its arc
        driver = replace(driver, at=None, range="assembled")
        arc = replace(task, driver=driver, poses=FEW)
        seen = solve(problem.with_task(name, arc), name)
        places = np.asarray(seen.drivers[driver.coordinate].position)
    elif data["live"] and 1 < len(places) < FEW:  # letters find places in poses between
        parts = -(-FEW // (len(places) - 1))
        seen = result.finer(parts)
        places = np.interp(np.arange(len(seen.status)) / parts, range(len(places)), places)
    data["scene"], drawing = scenes.drawn(seen, places, lang)
    drawing["range"] = [float(places.min()), float(places.max())]
    angles = scenes.angles_of(result, data["scene"], drawing)
    data["recorded"] = _recorded(result, FEW if data["live"] else MOST_RECORDED, angles)
    if not data["live"]:
        data["recorded"] |= lesson.series_of(result, data["recorded"]["rows"])
    main = link.MAIN if problem.mechanism.dimension == 2 else link.SPATIAL
    data["status"] = [data["status"][k] for k in data["recorded"]["rows"]]
    data["driver"]["values"] = [data["driver"]["values"][k] for k in data["recorded"]["rows"]]
    if not data["recorded"]["points"]:
        raise InputError(
            "no point of the task assembles, or it asks for none", where=f"tasks.{name}"
        )
    return Page(link.linked(data, kernels, main, drawing), data)


def _make_live(
    data: Json,
    problem: Problem,
    setting: Setting,
    run: Run,
    found: _Followed,
) -> Json:
    """Put what a live page needs into its data, and return its kernels."""
    loaded, drivers = found.loaded, ways.drivers_of(setting, found.result)
    statics = None if loaded is None else loaded.statics
    acting = {} if statics is None else efforts.functions(statics)
    acted = set() if statics is None else efforts.used(statics)
    sliders = live.numbers_that_move(setting, acted)[: live.MOST_SLIDERS]
    crossing, transmit = lesson.transmission(setting)
    model = setting.scene.model
    more = {**acting, **ways.functions(setting), "transmit": transmit}
    kernels, layout = live.kernels(ways.followed_by(setting), model, sliders, more)
    values = dict(zip(model.p_names, model.p_values.tolist(), strict=True))
    dimensions, shape = lesson.dimensions_of(
        setting, sliders, [values[number] for number in sliders]
    )
    typed = tomllib.loads(data["file"]).get("parameters", {})
    keys = {name: key for key, (name, _) in split_keys(typed, values).items()}
    limits = run.summary.get("limits") or (None, None)
    plan = setting.plan
    places = np.asarray(run.places, float)
    rows_of_checks = _telling(run)
    rates = [float(np.atleast_2d(rate)[0, plan.lead]) for rate in (plan.speed, plan.acceleration)]
    data |= {
        "kernels": layout,
        "entries": live.entries_of(setting),
        "sliders": [
            {**_slider(problem.mechanism, name, values[name]), "key": keys.get(name, "")}
            for name in sliders
        ],
        "start": live.numbers_of(setting, run),
        "bounded": live.bounded_of(setting.outputs),
        "drivers": drivers,
        "way": ways.way_of(setting, run),
        "pace": ways.pace_of(setting, run),
        "range": [float(places.min()), float(places.max())],
        "whole": plan.values is None or len(places) == 1,
        "limits": [None if end is None else float(end) for end in limits],
        "modes": live.modes_of(setting, run),
        "speed": rates[0],
        "acceleration": rates[1],
        "checks": _checks(run, rows_of_checks),
        "shape": shape,
        "forces": None if loaded is None else efforts.numbers(loaded, rows_of_checks),
        "slow": loaded is not None and loaded.moving.slow,
        "lesson": {
            "dimensions": dimensions,
            "transmission": crossing,
            **lesson.groups_of(found.result),
        },
    }
    if drivers is not None:
        way = data["way"]
        moving = drivers[way["driver"]] if way["kind"] == "alone" else way
        data["driver"] = {"name": moving["name"], "unit": moving["unit"], "values": plain(places)}
    return tables(kernels)


def _telling(run: Run) -> list[int]:
    """Return poses for a page to check itself with: of each part the best conditioned one."""
    poses = run.poses
    good = poses.alive.all(axis=1) & ~poses.at_limit
    for part in poses.y[:3]:
        good &= np.isfinite(part[:, :]).all(axis=1)
    good = np.flatnonzero(good)
    parts = [part for part in np.array_split(good, CHECKS) if part.size]
    return [int(part[np.argmin(poses.condition[part])]) for part in parts]


def _checks(run: Run, rows: list[int]) -> list[Json]:
    """Return values and rates of the outputs at poses, without any where the path begins."""
    poses, orders = run.poses, 3
    if not rows:
        poses, rows, orders = run.evaluator.at(run.path, [ways.start_of(run.path)[0]]), [0], 1
    return [
        {
            "s": float(poses.s[k]),
            "y": [link.rounded(np.asarray(part[k : k + 1, :])[0]) for part in poses.y[:orders]],
        }
        for k in rows
    ]


def _slider(mechanism: Mechanism, name: str, value: float) -> Json:
    """Return a number that can be changed, the range of its slider, and signs it may not have."""
    low, high = sorted((value / live.FAR, value * live.FAR)) if value else (-1.0, 1.0)
    refuses = ""
    for sign, changed in (("-", -abs(value) or -1.0), ("0", 0.0)):
        try:
            mechanism.with_values({name: changed})
        except MechdaeError:
            refuses += sign
    return {"name": name, "value": value, "low": low, "high": high, "refuses": refuses}


def _driver(result: Result) -> Json:
    """Return the coordinate that the cursor moves along: a driver, or time."""
    if result.time is not None:
        return {"name": "t", "unit": "s", "values": plain(np.asarray(result.time, float))}
    for name, series in result.drivers.items():
        values = np.asarray(series.position, float)
        if np.ptp(values) > 0 or len(result.drivers) == 1:
            unit = result.unit("drivers", name, "position")
            return {"name": name, "unit": unit, "values": plain(values)}
    name = next(iter(result.drivers))
    return {"name": name, "unit": "", "values": list(range(len(result.status)))}


def _ways(result: Result) -> list[Floats]:
    """Return the ways of all points, as large as they are seen."""
    return in_picture([np.asarray(series.position) for series in result.points.values()])


def _recorded(result: Result, most: int, angles: Mapping[str, Floats]) -> Json:
    """Return the places of all points at `most` poses, and angles of bodies."""
    count = len(result.status)
    rows = np.unique(np.linspace(0, count - 1, min(count, most)).astype(int)).tolist()

    def of(kind: str, name: str) -> dict[str, Floats]:
        known = getattr(result, kind).items()
        return {part: np.asarray(parts[name]) for part, parts in known if name in parts}

    found = {
        "points": of("points", "position"),
        "turns": of("bodies", "orientation"),
        "angles": angles,
    }
    return {"rows": rows} | {
        kind: {part: plain(values[rows].ravel()) for part, values in table.items()}
        for kind, table in found.items()
    }
