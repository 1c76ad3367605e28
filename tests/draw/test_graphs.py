"""Graphs of results: every predefined problem, numbers as in the result, nothing overlaps."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import mechdae as md
from mechdae.describe.file import library
from mechdae.draw import PICTURES, save
from mechdae.draw.graphs import frame, scale, series
from mechdae.errors import InputError, UnknownName
from mechdae.results import Series
from tests.shared.command import run
from tests.shared.graphed import coarse, drawn_readably, first_of_each_look
from tests.shared.paths import ROOT
from tests.shared.readable import assert_readable

CROWDED = ("chain-of-four-bars", "jansen-leg")
SAMPLE = sorted({*first_of_each_look(), *CROWDED})
GRAPHS = ("curves", "coupler", "losses", "map")


def line(panel, gid: str):
    return next(own for own in panel.lines if own.get_gid() == gid)


# -- every problem ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SAMPLE)
def test_problems_of_each_look_in_every_kind_that_applies(name: str) -> None:
    """Warnings are errors here; `python -m tests.scripts.every_graph` draws all problems."""
    drawn_readably(name)


# -- numbers ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rocker() -> md.Result:
    problem = md.load("four-bar-crank-rocker")
    task = replace(problem.tasks["turn"], measures=("extremes", "transmission"))
    return md.solve(problem, task)


@pytest.fixture(scope="module")
def rubbing() -> md.Result:
    problem = md.load("slider-crank-friction")
    return md.solve(problem, replace(problem.tasks["cycle"], poses=73))


@pytest.fixture(scope="module")
def jamming() -> md.Result:
    return md.solve("scotch-yoke-jam", "cycle")


def test_curves_hold_the_numbers_of_the_result(rocker: md.Result) -> None:
    axes = md.plot(rocker, "curves")
    own = line(axes, "curve-bodies/rocker/angle-rocker")
    assert own.get_xdata() == pytest.approx(np.rad2deg(rocker.drivers["crank.angle"].position))
    assert own.get_ydata() == pytest.approx(np.rad2deg(rocker.bodies["rocker"].angle), rel=1e-15)
    paths = ["points/coupler.P/velocity", "joints/C/transmission_angle", "condition", "bound"]
    axes = md.plot(rocker, "curves", paths=[*paths, "points/coupler.P/velocity/size"])
    panels = axes.figure.axes
    assert [panel.get_ylabel() for panel in panels] == [
        "velocity [mm/s]",
        "transmission angle [deg]",
        "condition",
        "bound [mm]",
        "bound [deg]",
    ]
    velocity = rocker.points["coupler.P"].velocity
    for word, values in (("x", velocity[:, 0]), ("y", velocity[:, 1])):
        own = line(panels[0], f"curve-points/coupler.P/velocity-coupler.P {word}")
        assert own.get_ydata() == pytest.approx(1000 * values, rel=1e-15)
    own = line(panels[0], "curve-points/coupler.P/velocity/size-|coupler.P|")
    assert own.get_ydata() == pytest.approx(1000 * np.hypot(*velocity.T), rel=1e-15)
    assert panels[2].get_yscale() == "log"
    assert np.array_equal(line(panels[2], "curve-condition-").get_ydata(), rocker.condition)


def test_extremes_are_the_refined_ones(rocker: md.Result) -> None:
    """Greatest angle of the rocker: crank and coupler in one line, by the law of cosines."""
    a, b, c, d = 0.04, 0.12, 0.08, 0.1
    found = md.load("four-bar-crank-rocker").mechanism.values()
    a, d = found["crank.B.x"], found["ground.D.x"]
    b, c = found["coupler.C.x"], found["rocker.C.x"]
    span = b - a
    inner = np.arccos((c**2 + d**2 - span**2) / (2 * c * d))
    axes = md.plot(rocker, "curves", paths=["bodies/rocker/angle"])
    mark = line(axes, "extreme-max-bodies/rocker/angle")
    low = line(axes, "extreme-min-bodies/rocker/angle")
    outer = np.arccos((c**2 + d**2 - (a + b) ** 2) / (2 * c * d))
    assert low.get_ydata()[0] == pytest.approx(180 - np.rad2deg(outer), abs=1e-10)
    assert mark.get_ydata()[0] == pytest.approx(180 - np.rad2deg(inner), abs=1e-10)
    without = md.plot(rocker, "curves", paths=["bodies/rocker/angle"], extremes=False)
    assert not [own for own in without.lines if str(own.get_gid()).startswith("extreme")]


def test_arcs_and_limits_are_where_they_are(jamming: md.Result) -> None:
    axes = md.plot(jamming, "curves")
    for panel in axes.figure.axes:
        spans = [own for own in panel.patches if own.get_gid() == "arc-jammed"]
        found = [(own.get_x(), own.get_x() + own.get_width()) for own in spans]
        assert np.array(found) == pytest.approx(np.rad2deg(jamming.summary["jammed_arcs"]))
    named = [own.get_text() for own in axes.texts if own.get_text().startswith("jammed")]
    assert named == ["jammed 56.443° … 123.56°, 236.44° … 303.56°"]
    window = coarse(md.load("gorshkov-seven-link"), "window")
    panel = md.plot(window, "curves")
    lines = [own.get_xdata()[0] for own in panel.lines if own.get_gid() == "event-limit"]
    assert sorted(lines) == pytest.approx(np.rad2deg(window.summary["limits"]), rel=1e-15)
    problem = md.load("four-bar-double-rocker")
    turn = md.Sweep(md.Driver("left.angle", from_=0.0, to=2 * np.pi), poses=37)
    result = md.solve(problem, turn)
    panel = md.plot(result, "curves")
    spans = [own for own in panel.patches if own.get_gid() == "arc-unassembled"]
    failed = [(own["from"], own["to"]) for own in result.summary["failed"]]
    found = [(own.get_x(), own.get_x() + own.get_width()) for own in spans]
    assert np.array(found) == pytest.approx(np.rad2deg(failed))


def test_nothing_is_marked_behind_a_stop() -> None:
    """The rocker is stopped at 70 and 115 degrees: arcs end there, by the law of cosines."""
    whole = md.load("four-bar-crank-rocker")
    mechanism = whole.mechanism
    pin = replace(mechanism.joints["D"], limits=(np.deg2rad(70), np.deg2rad(115)))
    stopped = replace(whole, mechanism=replace(mechanism, joints={**mechanism.joints, "D": pin}))
    driver = md.Driver("crank.angle", from_=0.0, to=2 * np.pi)
    task = md.Sweep(driver, poses=73, measures=["extremes"])
    panel = md.plot(md.solve(stopped, task), "curves", paths=["bodies/coupler/angle"])
    spans = [own for own in panel.patches if own.get_gid() == "arc-stopped"]
    a, b, c, d = 0.04, 0.12, 0.08, 0.1
    for at in (spans[0].get_x() + spans[0].get_width(), spans[1].get_x()):
        crank = np.deg2rad(at)
        gap = np.hypot(d - a * np.cos(crank), a * np.sin(crank))
        open_by = np.arccos((c**2 + gap**2 - b**2) / (2 * c * gap))
        rocker = np.pi - np.arctan2(a * np.sin(crank), d - a * np.cos(crank)) - open_by
        assert np.rad2deg(rocker) == pytest.approx(70 if at < 90 else 115, abs=1e-6)
    marks = [own for own in panel.lines if str(own.get_gid()).startswith("extreme")]
    assert len(marks) == 1
    (name,) = (own for own in panel.texts if " at " in own.get_text())
    edges = [panel.transData.transform((own.get_xdata()[0], 0))[0]
             for own in panel.lines if own.get_gid() == "event-stop"]  # fmt: skip
    box = name.get_window_extent()
    assert len(edges) == 4
    assert not any(box.x0 < x < box.x1 for x in edges)


def test_names_stand_where_curves_end_on_the_right() -> None:
    """The crank runs from 60 degrees down: the last pose is on the left."""
    whole = md.load("four-bar-double-rocker")
    down = md.Sweep(md.Driver("left.angle", from_=1.2, to=0.6), poses=9)
    panel = md.plot(md.solve(whole, down), "curves", paths=["bodies/right/angle"])
    x, y = line(panel, "curve-bodies/right/angle-right").get_data()
    (name,) = (own for own in panel.texts if own.get_text() == "right")
    assert x[0] > x[-1]
    assert name.xy[1] == pytest.approx(y[0], abs=1e-12)


def test_rounding_noise_is_zero() -> None:
    """Cranks of a parallelogram turn at one speed: nothing accelerates, nothing is a pole."""
    figure = md.plot(coarse(md.load("parallelogram-three-cranks"), "turn"), "curves").figure
    assert not np.any([own.get_ydata() for own in figure.axes[2].lines])
    assert figure.axes[2].get_ylabel() == "angular acceleration [deg/s²]"
    wankel = md.plot(coarse(md.load("wankel-rotor"), "cycle"), "curves").figure
    assert not [own for own in wankel.axes[0].lines if str(own.get_gid()).startswith("beyond")]


def test_change_points_and_time(rocker: md.Result) -> None:
    result = coarse(md.load("kite"), "turn")
    axes = md.plot(result, "curves")
    places = [own.get_xdata()[0] for own in axes.lines if own.get_gid() == "event-change_point"]
    assert sorted(places) == pytest.approx([0.0, 360.0, 720.0], abs=1e-6)
    result = coarse(md.load("five-bar-robot"), "circle")
    axes = md.plot(result, "curves")
    assert axes.figure.axes[-1].get_xlabel() == "time [s]"
    axes = md.plot(rocker, "curves", paths=["bodies/rocker/angle"], against="bodies/coupler/angle")
    own = line(axes, "curve-bodies/rocker/angle-rocker")
    assert own.get_xdata() == pytest.approx(np.rad2deg(rocker.bodies["coupler"].angle))


def finer(result: md.Result, axes, gid: str) -> md.Result:
    """Return a result at as many poses as a line of its picture has."""
    return result.finer((len(line(axes, gid).get_xdata()) - 1) // (len(result) - 1))


def along(line: Any, result: md.Result) -> Any:
    """Return the heights of a line at the driver's values; it has the places that are seen."""
    (driver,) = result.drivers.values()
    x, y = line.get_xdata(), line.get_ydata()
    return np.interp(np.degrees(driver.position), x, y)


def test_losses_are_stacked(rubbing: md.Result) -> None:
    axes = md.plot(rubbing, "losses")
    one = md.plot(rubbing, "losses", joints=["B"])
    scale = np.ptp(rubbing.joints["B"].loss)
    assert along(line(one, "top-B"), rubbing) == pytest.approx(
        rubbing.joints["B"].loss, abs=scale / 1000
    )
    rubbing = finer(rubbing, axes, "loss-uncoupled")
    names = ("slide", "O", "B", "C")  # by their sum over the poses, the largest below
    total = np.zeros(len(rubbing))
    for name in names:
        total = total + rubbing.joints[name].loss
        top = along(line(axes, f"top-{name}"), rubbing)
        assert top == pytest.approx(total, abs=np.ptp(total) / 1000)
    free = sum(rubbing.joints[name].loss_uncoupled for name in names)
    assert line(axes, "loss-uncoupled").get_ydata() == pytest.approx(free, rel=1e-14)
    assert line(axes, "loss-uncoupled").get_linestyle() == "--"


def test_polar_diagram(rubbing: md.Result) -> None:
    axes = md.plot(rubbing, "curves", polar=True, paths=["joints/B/reaction"])
    own = line(axes, "locus-B")
    whole, rubbing = rubbing, finer(rubbing, axes, "locus-B")
    force = rubbing.joints["B"].reaction[:, :2]
    assert np.stack(own.get_data(), axis=1) == pytest.approx(force / 1000, rel=1e-14)
    assert axes.get_xlabel() == "Fx [kN]"
    size = np.hypot(*force.T)
    assert line(axes, "peak-B").get_xdata() == pytest.approx([force[np.argmax(size), 0] / 1000])
    assert any(text.get_text().startswith(f"{size.max() / 1000:.4g} at ") for text in axes.texts)
    same = md.plot(whole, "losses", polar=True, joints=["B"])
    assert np.array_equal(line(same, "locus-B").get_xdata(), own.get_xdata())


def test_rates_stand_below_what_moves_by_default(rocker: md.Result) -> None:
    figure = md.plot(rocker, "curves").get_figure(root=True)
    labels = [panel.get_ylabel().partition(" [")[0] for panel in figure.axes]
    assert labels == ["angle", "angular velocity", "angular acceleration"]
    ends = [
        {gid.split("/")[1] for gid in map(str, map(Line2D.get_gid, panel.lines)) if "curve" in gid}
        for panel in figure.axes
    ]
    assert ends == [{"coupler", "rocker"}] * 3


def test_velocities_of_a_body_are_those_of_its_points(rocker: md.Result) -> None:
    with pytest.raises(UnknownName) as raised:
        md.plot(rocker, "curves", of="bodies/rocker/velocity")
    assert "points/rocker.C/velocity" in str(raised.value)


def test_extremes_have_room_for_their_names_and_no_more(rocker: md.Result) -> None:
    """The axis reaches 20 pt beyond the curves, whatever they span."""
    panel = md.plot(rocker, "curves", of="bodies/rocker/angle")
    values = np.degrees(rocker.bodies["rocker"].angle)
    low, high = panel.get_ylim()
    height = panel.get_window_extent().height * 72 / panel.get_figure(root=True).dpi
    room = np.array([values.min() - low, high - values.max()]) / np.ptp(values) * height
    assert room == pytest.approx([20.0, 20.0], rel=1e-2)


def test_ticks_of_equal_time(rocker: md.Result) -> None:
    """Every tick sits on a pose: 24 in a turn, 15 deg of the crank apart."""
    axes = md.plot(rocker, "coupler")
    places = rocker.points["coupler.P"].position * 1000
    assert np.array_equal(np.stack(line(axes, "locus-coupler.P").get_data(), axis=1), places)
    x, y = line(axes, "ticks-coupler.P").get_data()
    middles = np.stack([(x[0::3] + x[1::3]) / 2, (y[0::3] + y[1::3]) / 2], axis=1)
    assert middles == pytest.approx(places[:-1:15], abs=1e-10)
    speed = rocker.drivers["crank.angle"].velocity[0]
    said = next(own.get_text() for own in axes.texts if own.get_text().startswith("every"))
    assert said == f"every 15° of crank.angle, {np.deg2rad(15) / speed:.4g} s"
    hodograph = md.plot(rocker, "coupler", paths=["points/coupler.P/velocity"])
    data = np.stack(line(hodograph, "locus-coupler.P").get_data(), axis=1)
    assert data == pytest.approx(1000 * rocker.points["coupler.P"].velocity, rel=1e-15)
    width, height = np.diff(axes.get_xlim())[0], np.diff(axes.get_ylim())[0]
    box = axes.get_window_extent()
    assert width / height == pytest.approx(box.width / box.height)


def test_uneven_poses_have_no_ticks() -> None:
    task = md.Sweep(md.Driver("crank.angle", at=[0.0, 0.1, 0.7, 1.0]))
    axes = md.plot(md.solve("four-bar-crank-rocker", task), "coupler")
    assert not [own for own in axes.lines if str(own.get_gid()).startswith("ticks")]


# -- maps ------------------------------------------------------------------------------------------


def study(status: list[str], values: list[float], **parameters: list[float]) -> md.Result:
    """Return a study whose numbers are given: pictures are drawn from results alone."""
    return md.StudyResult(
        "slider-crank",
        "map",
        "study",
        md.load("slider-crank").mechanism,
        parameters={name: np.array(own) for name, own in parameters.items()},
        table={"summary/efficiency": np.array(values, float)},
        status=np.array(status),
        summary={"of": "cycle"},
    )


def test_map_over_two_parameters() -> None:
    a, b = (own.ravel() for own in np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij"))
    status = np.where(a + b > 6, "jammed", np.where(b > 2.5, "unassembled", "ok"))
    values = np.where(status == "ok", 0.9 - 0.35 * a + 0.1 * b, np.nan)
    values[6] = np.nan
    axes = md.plot(study(status.tolist(), values.tolist(), a=a.tolist(), b=b.tolist()), "map")
    cells = {own.get_gid() for own in axes.patches}
    assert {"set-jammed", "set-unassembled", "set-no value"} <= cells
    said = {own.get_text() for own in axes.texts}
    assert {"jammed", "unassembled", "no value", "self-locking: efficiency below 0"} <= said
    mesh = next(own for own in axes.collections if hasattr(own, "get_coordinates"))
    table = np.full((4, 5), np.nan)
    table[b.astype(int), a.astype(int)] = values
    assert np.array_equal(np.ma.filled(mesh.get_array(), np.nan), table, equal_nan=True)
    assert_readable(axes)


def test_map_over_one_parameter_and_held_ones() -> None:
    result = study(["ok", "ok", "jammed"], [0.9, 0.8, np.nan], a=[0.0, 0.1, 0.2])
    axes = md.plot(result, "map")
    own = line(axes, "curve-efficiency")
    assert np.array_equal(own.get_xdata(), [0.0, 0.1, 0.2])
    assert np.array_equal(own.get_ydata(), [0.9, 0.8, np.nan], equal_nan=True)
    both = study(["ok"] * 4, [1, 2, 3, 4], a=[0, 0, 1, 1], b=[0, 1, 0, 1])
    axes = md.plot(both, "map", along=["a"])
    assert np.array_equal(line(axes, "curve-efficiency").get_ydata(), [1.0, 3.0])
    assert any("b = 0" in own.get_text() for own in axes.texts)
    with pytest.raises(UnknownName, match="eficiency"):
        md.plot(both, "map", paths=["summary/eficiency"])
    with pytest.raises(InputError, match="no curves"):
        md.plot(both, "curves")


def test_workspace_of_two_drivers() -> None:
    """The tip of the five-bar reaches where both dyads close: circles of its links."""
    problem = md.load("five-bar-robot")
    place = md.Sweep(
        drivers=[md.Driver("tip.P.x", at=["xc"]), md.Driver("tip.P.y", at=["yc"])], derivatives=0
    )
    grid = {"xc": [-0.3, 0.5, 5], "yc": [0.05, 0.55, 4]}
    task = md.Study(vary=grid, of="place", outputs=["condition"])
    result = md.solve(problem.with_task("place", place), task)
    x, y = result.parameters["xc"], result.parameters["yc"]
    near = [np.hypot(x - foot, y) for foot in (0.0, 0.2)]
    reached = np.all([(own > 0.1) & (own < 0.5) for own in near], axis=0)
    assert np.array_equal(result.status == "ok", reached)
    axes = md.plot(result, "map", equal=True)
    assert "set-unassembled" in {own.get_gid() for own in axes.patches}
    driver = [md.Driver("left.angle", at=[2.0, 2.0, 2.1]), md.Driver("right.angle", at=[1, 1.1, 1])]
    axes = md.plot(md.solve(problem, md.Sweep(drivers=driver)), "map")
    assert axes.get_xlabel() == "left.angle [deg]"


def test_data_of_the_efficiency_map() -> None:
    """One of the written sets, solved again."""
    spec = importlib.util.spec_from_file_location(
        "efficiency_map", ROOT / "plots/efficiency_map.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    data = json.loads(module.DATA.read_text())
    k = 20
    values = {name: own[k] for name, own in data["parameters"].items()}
    found = md.solve(module.problem(), "cycle", set=values)
    assert found.summary["efficiency"] == pytest.approx(data["efficiency"][k], rel=1e-9)
    assert len(data["status"]) == 169


# -- the frame -------------------------------------------------------------------------------------


def test_given_axes_are_divided_and_returned(rubbing: md.Result) -> None:
    figure = Figure(figsize=(10, 6))
    FigureCanvasAgg(figure)
    given = figure.add_axes((0.55, 0.2, 0.4, 0.6))
    assert md.plot(rubbing, "curves", given) is given
    panels = figure.axes
    assert len(panels) == 3
    for panel in panels:
        box = panel.get_position()
        assert box.x0 == pytest.approx(0.55)
        assert box.x1 <= 0.95 + 1e-12
        assert 0.2 - 1e-12 <= box.y0 < box.y1 <= 0.8 + 1e-12
    for kind in ("losses", "coupler"):
        given = figure.add_axes((0.1, 0.2, 0.3, 0.5))
        assert md.plot(rubbing, kind, given) is given
        given.remove()


@pytest.mark.parametrize("kind", ["curves", "losses", "coupler"])
def test_files_are_the_same_each_time(kind: str, rubbing: md.Result, tmp_path: Path) -> None:
    first = save(md.plot(rubbing, kind), tmp_path / "a.svg").read_bytes()
    problem = md.load("slider-crank-friction")
    again = md.solve(problem, replace(problem.tasks["cycle"], poses=73))
    assert save(md.plot(again, kind), tmp_path / "b.svg").read_bytes() == first
    assert b'id="curve-efforts/crank.angle' in first or kind != "curves"


def test_labels_keep_their_distance() -> None:
    found = frame.spread([5.0, 5.0, 5.0, 90.0], 10.0, 0.0, 100.0)
    assert np.diff(sorted(found)).min() >= 10.0 - 1e-9
    assert found[3] == 90.0
    found = frame.spread([50.0] * 20, 10.0, 0.0, 100.0)
    assert np.diff(sorted(found)).min() == pytest.approx(100 / 19)


@pytest.mark.parametrize(
    ("unit", "largest", "shown"),
    [
        ("m", 0.146, ("mm", 1e3)),
        ("m", 2.5e-6, ("µm", 1e6)),
        ("m", 12.0, ("m", 1.0)),
        ("N", 1038.0, ("kN", 1e-3)),
        ("N m", 0.4, ("N m", 1.0)),
        ("N m", 0.02, ("mN m", 1e3)),
        ("rad", 1.0, ("deg", 180 / np.pi)),
        ("rad/s", 5e4, ("rad/s", 1.0)),
        ("1", 5.0, ("", 1.0)),
    ],
)
def test_units_that_are_read_well(unit, largest, shown) -> None:
    found = scale.scale_of(unit, [np.array([0.0, -largest, np.nan])])
    assert (found.unit, found.factor) == pytest.approx(shown)


def test_unknown_paths_are_answered(rocker: md.Result) -> None:
    for path, near in (
        ("bodies/roker/angle", "rocker"),
        ("bodies/rocker/angel", "angle"),
        ("body/rocker", "body/rocker"),
        ("points/coupler.P/velocity/z", "component"),
        ("efforts_static", "path"),
    ):
        with pytest.raises(UnknownName, match=near):
            md.plot(rocker, "curves", paths=[path])
    with pytest.raises(InputError, match="no vector"):
        md.plot(rocker, "coupler", paths=["bodies/rocker/angle"])
    with pytest.raises(InputError, match="m and in m/s"):
        md.plot(rocker, "coupler", paths=["coupler.P", "points/coupler.P/velocity"])
    with pytest.raises(InputError, match="no curves"):
        md.plot(md.solve("four-bar-crank-rocker", "modes"), "curves")


def test_series_without_friction_stand_beside(rubbing: md.Result) -> None:
    free = series.lines_of(rubbing, "efforts_uncoupled")[0]
    assert free.partner == "efforts/crank.angle"
    assert np.array_equal(free.values, rubbing.parts["uncoupled"]["crank.angle"])
    axes = md.plot(rubbing, "curves", paths=["joints/B/loss", "joints/B/loss_uncoupled"])
    whole, other = axes.lines[:2]
    assert whole.get_color() == other.get_color()
    assert whole.get_linestyle() != other.get_linestyle()
    assert isinstance(rubbing.joints["B"], Series)


# -- the command -----------------------------------------------------------------------------------


def test_kind_by_task(capsys, tmp_path: Path) -> None:
    out = ["--out", str(tmp_path)]
    code, said, _ = run(capsys, "plot", "spur-gears-idler", "--task", "bearings", *out)
    assert (code, Path(said.strip()).name) == (0, "spur-gears-idler-bearings-curves.svg")
    code, said, _ = run(capsys, "plot", "jamming-drawer", "--task", "side", "--pose", "2", *out)
    assert (code, Path(said.strip()).name) == (0, "jamming-drawer-side-diagram-2.svg")
    code, said, _ = run(capsys, "plot", "slider-crank", *out)
    assert (code, Path(said.strip()).name) == (0, "slider-crank-turn-diagram.svg")
    text = library.find("slider-crank").read_text()
    text += '\n[tasks.map]\nkind = "study"\nof = "turn"\nvary = { r = [0.1, 0.2, 3] }\n'
    path = tmp_path / "map.toml"
    path.write_text(text + 'outputs = ["summary/stroke/guide"]\n')
    code, said, _ = run(capsys, "plot", str(path), "--kind", "map", "--format", "pdf", *out)
    assert (code, Path(said.strip()).name) == (0, "map-map-map.pdf")


def test_paths_of_the_command(capsys, tmp_path: Path) -> None:
    words = ["plot", "four-bar-crank-rocker", "--out", str(tmp_path)]
    angle = ["--kind", "curves", "--of", "joints/C/transmission_angle"]
    code, said, err = run(capsys, *words, *angle)
    assert (code, err) == (0, "")
    svg = Path(said.strip()).read_text()
    assert 'id="extreme-min-joints/C/transmission_angle"' in svg
    words = ["plot", "gorshkov-seven-link", "--out", str(tmp_path)]
    code, said, err = run(capsys, *words, "--kind", "coupler")  # the first sweep is a single pose
    assert (code, Path(said.strip()).stem) == (0, "gorshkov-seven-link-window-coupler")
    words += ["--task", "turn"]
    code, said, err = run(capsys, *words, "--kind", "curves", "--of", "bodies/rod/angle")
    assert (code, err) == (0, "")
    assert 'id="curve-bodies/rod/angle-rod"' in Path(said.strip()).read_text()
    for wrong, text in (
        (["--of", "x"], "--of is for"),
        (["--kind", "coupler", "--polar"], "--polar is for"),
        (["--kind", "curves", "--pose", "3"], "shows all poses"),
        (["--kind", "losses"], "no losses"),
        (["--kind", "map"], "a map is drawn of a study"),
    ):
        code, said, err = run(capsys, *words, *wrong)
        assert (code, said) == (2, "")
        assert text in err


def test_kinds_are_entered() -> None:
    assert set(GRAPHS) <= set(PICTURES)
