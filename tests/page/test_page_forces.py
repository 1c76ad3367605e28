"""Forces on a live page: efforts, reactions, jammed arcs are those of Python; modes as ghosts."""

from __future__ import annotations

import json

import numpy as np
import pytest

import mechdae as md
from tests.shared.live import in_page, tables_of
from tests.shared.node import needs_node, run_script

pytestmark = needs_node
FORCES = """
const poses = {places}.map((s) => session.motion.pose(s));
console.log(JSON.stringify(poses.map((pose) => {{
  const own = session.forcesAt(pose);
  return [own.status, own.still, own.efforts, own.reactions, own.losses, own.critical];
}})));
"""


@pytest.mark.parametrize(
    ("name", "task"),
    [
        ("slider-crank-inertia", "cycle"),
        ("quick-return-friction", "cycle"),
        ("rocker-40-1-05", "cycle"),
        ("four-stroke-engine", "cycle"),
        ("scotch-yoke-jam", "cycle"),
    ],
)
def test_forces_are_those_of_python(name, task, tmp_path):
    page = md.page(name, task)
    result = md.solve(name, task)
    (effort,) = result.efforts
    places = result.drivers[effort].position[::9]
    found = in_page(page, FORCES.format(places=json.dumps(places.tolist())), tmp_path)
    largest = np.nanmax(np.abs(result.efforts[effort]))
    compared = 0
    for k, (status, still, efforts, reactions, losses, critical) in zip(
        range(0, len(result), 9), found, strict=True
    ):
        assert status == result.status[k]
        if status == "jammed":
            assert critical < 1
            continue
        if still:  # at dead centres the page takes the sign of the coming motion
            continue
        compared += 1
        assert abs(efforts[effort] - result.efforts[effort][k]) <= 1e-13 * largest
        size = max(np.nanmax(np.abs(result.joints[joint].reaction)) for joint in reactions)
        for joint, own in reactions.items():
            assert np.abs(np.array(own) - result.joints[joint].reaction[k]).max() <= 1e-13 * size
        for joint, loss in losses.items():
            assert loss == pytest.approx(result.joints[joint].loss[k], rel=1e-12, abs=1e-12)
    assert compared > 3


def test_forces_follow_changed_loads_and_dimensions(tmp_path):
    """Loads and dimensions are changed in the page and, anew, in Python."""
    name, values = "slider-crank-inertia", {"Q_work": 700.0, "f": 0.15, "l": 0.27, "m_rod": 2.0}
    result = md.solve(name, "cycle", set=values)
    rows = [20, 75, 140, 260]
    body = f"""
const values = {json.dumps(values)};
session.dimension(session.theta.map((v, k) => values[data.sliders[k].name] ?? v));
""" + FORCES.format(places=json.dumps(result.drivers["crank.angle"].position[rows].tolist()))
    for k, own in zip(rows, in_page(md.page(name, "cycle"), body, tmp_path), strict=True):
        assert own[2]["crank.angle"] == pytest.approx(result.efforts["crank.angle"][k], rel=1e-12)


def test_altered_forces_are_left_out(tmp_path):
    page = md.page("slider-crank-inertia", "cycle")
    data = json.loads(json.dumps(dict(page.data)))
    data["forces"]["checks"][3]["f"][1][0] *= 1 + 1e-6
    from mechdae.parts.page import link

    text = link.linked(data, tables_of(page.html))
    shown = in_page(
        md.Page(text, data),
        "console.log(JSON.stringify([session.trusted, session.checkForces(), session.forces]));",
        tmp_path,
    )
    assert shown == [True, False, None]


def test_other_modes_are_those_of_python(tmp_path):
    """At the sketch's driver value the ghosts and the mode shown are the modes of Python."""
    page = md.page("gorshkov-seven-link", "window")
    start, found = in_page(
        page,
        """
session.ghosts.carry(session.theta, session.range, session.mode);
const { s } = data.start;
const own = [...session.ghosts.at(s), { label: session.mode, pose: session.motion.pose(s) }];
const places = own.map(({ label, pose }) => [label, session.places_of(pose)["rocker.E"]]);
console.log(JSON.stringify([s, places]));
""",
        tmp_path,
    )
    modes = md.solve(
        md.load("gorshkov-seven-link").mechanism,
        md.Modes(driver=md.Driver("crank.angle", at=(start,))),
    )
    truth = {
        ",".join(row): modes.points["rocker.E"].position[k] for k, row in enumerate(modes.labels)
    }
    assert {label for label, _ in found} == set(truth)
    for label, place in found:
        assert place == pytest.approx(truth[label].tolist(), abs=1e-9)


def test_extremes_are_not_made_by_a_jump(tmp_path):
    """What jumps has its extremes among the poses; a smooth curve has them between."""
    from mechdae.parts.page.link import WEB

    jumping = [[230.0, 215.0, 205.0, 200.2, 1000.0, 1010.0, 1030.0], [3.0, 2.0, 0.9, 7.0, 7.5, 8.0]]
    jumping.append([6.8, 5.7, 4.5, 0.66, 0.9, 1.1])
    smooth = [9.0 - (k - 3.3) ** 2 for k in range(7)]
    cornered = [abs(np.sin(0.1 * (k - 3.3))) for k in range(8)]
    script = f"""
globalThis.WORDS = {{}};
const {{ extremes }} = await import("{(WEB / "chart.js").as_posix()}");
const of = (values) => extremes(values.map((_, k) => k), values);
const pairs = (values) => of(values).map(({{ place, value, corner }}) => [place, value, corner]);
console.log(JSON.stringify({json.dumps([*jumping, smooth, cornered])}.map(pairs)));
"""  # fmt: skip
    *found, between, corner = run_script(script, tmp_path)
    for values, own in zip(jumping, found, strict=True):
        for place, value, _ in own:
            assert value == values[int(place)]
        assert {value for _, value, _ in own} == {min(values), max(values)}
    assert between[0] == [pytest.approx(3.3, abs=1e-12), pytest.approx(9.0, abs=1e-12), False]
    assert [own[2] for own in corner] == [False, True]  # whose least value is between the poses


def test_a_page_of_forces_gives_its_own_file_back():
    page = md.page("slider-crank-inertia", "cycle")
    assert 'kind = "reactions"' in page.data["file"]
    assert page.data["units"]["Q_work"] == "N"
    assert md.page(md.solve("slider-crank-inertia", "cycle")).data["forces"] is not None


@pytest.mark.parametrize(
    ("reference", "shift", "changed"),
    [
        ("coupler.P", (0.01, -0.005), {"px", "py"}),
        ("rocker.C", (0.008, 0.004), {"b", "c"}),
        ("rocker.D", (-0.006, 0.0), {"d"}),
    ],
)
def test_points_are_pulled_as_dimensions(reference, shift, changed, tmp_path):
    """The numbers that place a point bring it where it is pulled; the driver stays."""
    from mechdae.parts.page.link import WEB

    body = f"""
const {{ pulled }} = await import("{(WEB / "shape.js").as_posix()}");
session.drive(1.0);
const at = () => session.places_of(session.pose)["{reference}"];
const [x, y] = at();
const theta = pulled(session, "{reference}", [x + {shift[0]}, y + {shift[1]}]);
const t = session.dimension(theta);
const moved = data.sliders.filter((own, k) => session.theta[k] !== own.value);
console.log(JSON.stringify([t, session.s, moved.map((own) => own.name), at()[0] - x, at()[1] - y]));
"""
    t, s, moved, dx, dy = in_page(md.page("four-bar-crank-rocker"), body, tmp_path)
    assert (t, s) == (1, 1.0)
    assert set(moved) == changed
    assert (dx, dy) == pytest.approx(shift, abs=1e-8)
