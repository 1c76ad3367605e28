"""Loads, springs and dampers in diagrams; words and colours."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex

import mechdae as md
from mechdae.draw import style
from mechdae.draw.diagram import amounts
from mechdae.draw.diagram.loads import peak_force
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.fragments import fragments
from mechdae.draw.words import PREFIXES, Words, table
from tests.scripts.labelling import count

RADIUS, ROD = 0.2, 0.5
LOADS = [
    md.Spring("k1", between=("ground.Q", "rod.P"), stiffness=100.0, damping=3.0),
    md.Spring("k2", coordinate="guide.slide", stiffness=300.0),
    md.Spring("k3", coordinate="crank.angle", stiffness=3.0, damping=1.0),
    md.Force("F", point="rod.P", value=(60.0, -80.0)),
    md.Force("along", point="rod.B", value=(5.0, 0.0), frame="rod"),
    md.Force("later", point="rod.P", value=("-300*t", 20.0)),
    md.Torque("M", body="rod", value=-12.0),
    md.Resistance("R", coordinate="guide.slide", negative=500.0, positive=250.0),
    md.TableLoad(
        "gas",
        coordinate="crank.angle",
        rows=((0.0, 0.0), (np.pi, 10.0), (2 * np.pi, 0.0)),
        factor=-2.0,
        along="guide.slide",
        periodic=True,
    ),
]
ANGLES = np.deg2rad(np.arange(20.0, 381.0, 15.0))


@pytest.fixture(scope="module")
def result():
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0], "Q": [0.3, 0.35]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "A": [RADIUS, 0]}, mass=2.0, center=(0.07, 0.0)),
            md.Body("rod", {"A": [0, 0], "B": [ROD, 0], "P": [0.2, 0.12]}, mass=1.0),
            md.Body("slider", {"B": [0, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "rod.A"),
            md.Revolute("B", "rod.B", "slider.B"),
            md.Prismatic("guide", "ground.O", "slider.B"),
        ],
        loads=LOADS,
        sketch={"crank": ANGLES[0], "rod": -0.2, "guide": 0.6},
        gravity=(0.0, -9.81),
    )
    driver = md.Driver("crank.angle", at=[float(a) for a in ANGLES])
    return md.solve(mechanism, md.Sweep(driver, poses=None))


def with_gid(ax, gid):
    return [artist for artist in ax.get_children() if artist.get_gid() == gid]


def shaft(ax, name):
    """Return start and direction of a straight arrow."""
    points = with_gid(ax, f"load-{name}")[0].get_xydata()
    return points[0], (points[-1] - points[0]) / np.hypot(*(points[-1] - points[0]))


def slider(angle):
    """Return the place of the slider and the direction of the rod in closed form."""
    lift = np.arcsin(RADIUS * np.sin(angle) / ROD)
    return RADIUS * np.cos(angle) + ROD * np.cos(lift), np.array([np.cos(lift), -np.sin(lift)])


@pytest.mark.parametrize("pose", [1, 12, 20])
def test_arrows_of_forces(result, pose):
    ax = md.plot(result, pose=pose)
    place, along = slider(ANGLES[pose])
    _, direction = shaft(ax, "F")
    assert direction == pytest.approx([0.6, -0.8])
    start, direction = shaft(ax, "along")
    assert direction == pytest.approx(along)
    across = (start - (place, 0.0)) @ [-along[1], along[0]]
    assert abs(across) < 1e-9  # on its line of action
    _, direction = shaft(ax, "gas")
    assert direction == pytest.approx([-1, 0])
    # the slider runs to the left in the first half turn: a resistance pushes to the right
    _, direction = shaft(ax, "R")
    assert direction == pytest.approx([np.sign(np.sin(ANGLES[pose])), 0])


def test_values_of_loads(result):
    scene = read_scene(result)
    loads = scene.mechanism.loads

    def value(name, pose):
        return amounts.load_values(scene, result, loads[name], pose)

    assert value("F", 3) == (60.0, -80.0)
    assert value("later", 3) is None  # there is no time in this sweep
    assert value("M", 3) == (-12.0,)
    for pose in (1, 12, 20):
        angle = ANGLES[pose] % (2 * np.pi)
        table = np.interp(angle, [0.0, np.pi, 2 * np.pi], [0.0, 10.0, 0.0])
        assert value("gas", pose)[0] == pytest.approx(-2.0 * table)
        assert value("R", pose)[0] == (500.0 if np.sin(angle) > 0 else 250.0)
    assert peak_force(scene, result, range(len(ANGLES))) == 500.0


def test_a_driver_that_runs_backwards_turns_resistances(result):
    driver = md.Driver("crank.angle", at=[float(a) for a in ANGLES[:6]], speed=-1.0)
    back = md.solve(result.mechanism, md.Sweep(driver, poses=None))
    scene = read_scene(back)
    load = scene.mechanism.loads["R"]
    assert amounts.load_values(scene, back, load, 2) == (250.0,)  # the slider runs to the right
    _, direction = shaft(md.plot(back, pose=2), "R")
    assert direction == pytest.approx([-1, 0])


def test_resistances_that_drive_point_along_the_motion(result):
    mechanism = replace(result.mechanism, loads={"R": result.mechanism.loads["R"]})
    driver = md.Driver("crank.angle", at=[float(a) for a in ANGLES[:6]])
    for direction, way in (("driver", 1.0), ("load", -1.0)):
        task = md.Reactions(driver, poses=None, direction=direction)
        _, arrow = shaft(md.plot(md.solve(mechanism, task), pose=2), "R")
        assert arrow == pytest.approx([way, 0])  # the slider runs to the left


def test_springs_dampers_masses(result):
    ax = md.plot(result, pose=1)
    assert len(with_gid(ax, "load-k1")) == 2  # spring and damper between the same points
    assert len(with_gid(ax, "load-k2")) == 1
    assert len(with_gid(ax, "load-k3")) == 3  # spiral and two rims of the rotary damper
    assert len(with_gid(ax, "mass-crank")) == 1
    assert not with_gid(ax, "mass-rod")  # its centre is a joint
    tail, *_, head = with_gid(ax, "gravity")[0].get_xydata()
    assert head[1] < tail[1]
    assert head[0] == pytest.approx(tail[0])
    assert with_gid(ax, "support-ground.Q")
    names = [str(artist.get_gid()) for artist in md.plot(result, loads=False).get_children()]
    assert not [name for name in names if name.startswith(("load", "label-load", "gravity"))]


def test_a_spring_ends_at_its_points(result):
    ax = md.plot(result, pose=12)
    spring, damper = (line.get_xydata() for line in with_gid(ax, "load-k1"))
    middle = (spring[0] + damper[0]) / 2
    assert np.hypot(*(middle - (0.3, 0.35))) < 0.05
    assert len(spring) > 8


def test_few_loads_tell_their_size():
    ax = md.plot(md.solve("toggle-press", "turn", poses=9), pose=3)
    (text,) = with_gid(ax, "label-load-press")
    assert text.get_text().startswith("press = ")


def test_loads_are_labelled_clear_of_everything(result):
    for pose in (1, 12, 20):
        assert count(result, pose=pose)["names"] == []


def test_words_are_the_same_in_every_language():
    for lang in PREFIXES:
        assert set(table(lang)) == set(table("en")), lang
        for key, text in table(lang).items():
            assert text.count("{") == table("en")[key].count("{"), key
    with pytest.raises(md.UnknownName, match="en"):
        Words("fr")


@pytest.mark.parametrize(
    ("value", "english", "russian"),
    [
        (1234.0, "1.23 kN", "1,23 кН"),
        (0.0, "0 N", "0 Н"),
        (-0.012, "\N{MINUS SIGN}12 mN", "\N{MINUS SIGN}12 мН"),
        (999.7, "1 kN", "1 кН"),
        (2.5e6, "2.5 MN", "2,5 МН"),
    ],
)
def test_amounts(value, english, russian):
    assert Words("en").amount(value, "N") == english
    assert Words("ru").amount(value, "N") == russian


def test_russian_diagram(result):
    ax = md.plot(result, lang="ru", pose=3)
    (text,) = with_gid(ax, "subtitle")
    assert "положение 4 из 25" in text.get_text()
    (text,) = with_gid(ax, "scale-text")
    assert text.get_text().endswith(" мм")


def contrast(first, second):
    """Return the contrast of two colours as WCAG 2.1 defines it."""

    def luminance(color):
        c = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) / 255
        return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) @ [
            0.2126,
            0.7152,
            0.0722,
        ]

    high, low = sorted((luminance(first), luminance(second)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", [style.LIGHT, style.DARK], ids=["light", "dark"])
def test_colours_stand_out_from_the_paper(theme):
    paper = theme.paint(style.PAPER)
    for color in (style.INK, style.GROUND, style.FAINT, style.LOAD, style.DRIVEN, style.WHEEL):
        assert contrast(theme.paint(color), paper) >= 4.5
    assert contrast(theme.paint(style.ARROW), paper) >= 3.0


def test_a_page_turns_each_load_at_one_joint(result):
    """The drive, a torsion spring, a torque and a table turn about one pin."""
    drawing = fragments(result, np.linspace(0.0, 1.0, len(result.status)))[1]
    parts = {part["id"]: len(part["shapes"]) for part in drawing["parts"] if "shapes" in part}
    assert {"driver-crank.angle", "load-k3", "load-gas"} <= parts.keys()
    assert parts["load-gas"] % 2 == 0  # shafts and heads


def test_dark_paper_is_a_value(result):
    ax = md.plot(result, dark=True, pose=3)
    figure = ax.get_figure()
    assert to_hex(figure.get_facecolor()) == style.DARK.paint(style.PAPER)
    assert to_hex(with_gid(ax, "body-rod-polygon")[0].get_facecolor()) == style.DARK.paint(
        style.FILL
    )
    light = md.plot(result, pose=3)
    assert to_hex(light.get_figure().get_facecolor()) == style.PAPER


def test_the_scale_bar_keeps_off_loads():
    axes = md.plot(md.solve("toggle-press", "turn", poses=25), "diagram", pose=4, width="90mm")
    rows = {own.get_gid(): own.get_xydata() for own in axes.lines}
    bar, load = rows["scale-bar"], rows["load-press"]
    assert load[:, 1].min() < bar[:, 1].max()
    assert bar[:, 0].max() < load[:, 0].min() or bar[:, 0].min() > load[:, 0].max()


def test_centres_of_mass_beside_their_links_are_tied_to_them():
    axes = md.plot("andrews-squeezer", "diagram")
    ties = {own.get_gid(): own.get_xydata() for own in axes.lines if "-tie" in str(own.get_gid())}
    assert len(ties) >= 2
    marks = {own.get_gid(): own.center for own in axes.patches if hasattr(own, "center")}
    for gid, (center, foot) in ties.items():
        np.testing.assert_allclose(center, marks[gid.removesuffix("-tie")], atol=1e-12)
        assert np.hypot(*(foot - center)) > 0
