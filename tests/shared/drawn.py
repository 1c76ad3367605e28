"""Mechanisms to draw, with poses found without the package: stand-ins for results."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

import mechdae as md
from mechdae.describe.mechanism import GROUND

POSES = np.deg2rad(np.arange(20.0, 381.0, 15.0))


def turn(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def residuals(mechanism, numbers, q):
    """Constraint equations of planar poses q = {body: (x, y, angle)}."""

    def at(reference):
        x, y, angle = q[reference.split(".")[0]]
        return np.array([x, y]) + turn(angle) @ [numbers[f"{reference}.{a}"] for a in "xy"]

    result = []
    for joint in mechanism.joints.values():
        step = at(joint.second) - at(joint.first)
        angle = q[joint.second_body][2] - q[joint.first_body][2]

        def number(entry, name=joint.name):
            return numbers[f"{name}.{entry}"]

        if joint.kind in ("prismatic", "pin-in-slot"):
            result.append((turn(q[joint.first_body][2] + number("axis")).T @ step)[1])
        if joint.kind in ("revolute", "weld"):
            result.extend(step)
        if joint.kind in ("prismatic", "weld"):
            result.append(angle - number("turn"))
        if joint.kind == "distance":
            result.append((step @ step - number("length") ** 2) / number("length"))
        if joint.kind in ("gear", "belt"):
            carrier = q[joint.carrier or GROUND][2]
            first, second = (q[b][2] - carrier for b in (joint.first_body, joint.second_body))
            result.append(first - number("ratio") * second - number("phase"))
        if joint.kind == "rack":
            axis = turn(q[joint.second_body][2] + number("axis"))[:, 0]
            result.append(axis @ step - number("radius") * q[joint.first_body][2])
    return np.array(result)


def make_result(mechanism, driver, values, guess, kind="sweep", title="", **more):
    """Return a stand-in for a result: poses by Newton's method from pose to pose.

    ``guess`` is {body: (x, y, angle)} near the first pose; ``driver`` a body whose angle
    takes the `values`. A pose that does not assemble has the status "unassembled".
    """
    names, numbers = list(mechanism.bodies), mechanism.values()
    z = np.array([guess[name] for name in names], dtype=float).ravel()

    def equations(z, value):
        q = {GROUND: np.zeros(3), **dict(zip(names, z.reshape(-1, 3), strict=True))}
        return np.append(residuals(mechanism, numbers, q), q[driver][2] - value)

    rows, status = [], []
    for value in np.atleast_1d(values):
        x = z.copy()
        for _ in range(15):
            f = equations(x, value)
            if np.abs(f).max() < 1e-12:
                break
            step = 1e-6
            jacobian = np.array(
                [(equations(x + d, value) - f) / step for d in step * np.eye(len(x))]
            )
            x = x - np.linalg.lstsq(jacobian.T, f, rcond=1e-9)[0]
        good = np.abs(equations(x, value)).max() < 1e-9
        z = x if good else z
        rows.append(x.reshape(-1, 3) if good else np.full((len(names), 3), np.nan))
        status.append("ok" if good else "unassembled")
    poses = dict(zip(names, np.array(rows).transpose(1, 0, 2), strict=True))
    points = {}
    for name, body in mechanism.bodies.items():
        for point in body.points:
            local = [numbers[f"{name}.{point}.{axis}"] for axis in "xy"]
            place = np.array([p[:2] + turn(p[2]) @ local for p in poses[name]])
            points[f"{name}.{point}"] = SimpleNamespace(position=place)
    return SimpleNamespace(
        mechanism=mechanism,
        problem="sample",
        task="task",
        kind=kind,
        title=title,
        status=np.array(status),
        bodies={name: SimpleNamespace(angle=pose[:, 2]) for name, pose in poses.items()},
        points=points,
        joints={},
        drivers={f"{driver}.angle": SimpleNamespace(position=np.atleast_1d(values))},
        summary=more.get("summary", {}),
    )


def seven_link(values=None):
    og = 0.46790884005019448852
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0], "G": [0, -og], "F": [0.8727, 0]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "A": [0.1716, 0]}, number=1),
            md.Body("block", {"A": [0, 0]}, number=2),
            md.Body("rod", {"G": [0, 0], "B": [0.8342, 0]}, number=3),
            md.Body("connecting_rod", {"B": [0, 0], "C": [0.5179, 0]}, number=4),
            md.Body("slider", {"C": [0, 0]}, number=5),
            md.Body("coupler", {"B": [0, 0], "E": [0.54, 0]}, number=6),
            md.Body("rocker", {"F": [0, 0], "E": [0.3013, 0]}, number=7),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "block.A"),
            md.Prismatic("slot", "rod.G", "block.A"),
            md.Revolute("G", "ground.G", "rod.G"),
            md.Revolute("BC", "rod.B", "connecting_rod.B"),
            md.Revolute("BE", "rod.B", "coupler.B"),
            md.Revolute("C", "connecting_rod.C", "slider.C"),
            md.Prismatic("guide", "ground.O", "slider.C"),
            md.Revolute("E", "rocker.E", "coupler.E"),
            md.Revolute("F", "ground.F", "rocker.F"),
        ],
    )
    d = np.deg2rad
    guess = {
        "crank": (0, 0, d(40)),
        "block": (0.13, 0.11, d(75)),
        "rod": (0, -og, d(75)),
        "connecting_rod": (0.2, 0.34, d(-40)),
        "slider": (0.6, 0, 0),
        "coupler": (0.2, 0.34, d(-10)),
        "rocker": (0.8727, 0, d(120)),
    }
    values = d([38.117]) if values is None else values
    title = "Seven-link lever mechanism, crank with three dyads in two branches"
    return make_result(mechanism, "crank", values, guess, title=title)


def five_bar(values=None):
    mechanism = md.Mechanism(
        ground=md.Ground({"D": [0, 0], "A": [0.1, 0]}),
        bodies=[
            md.Body("crank", {"A": [0, 0], "B": [0.048, 0]}, number=1),
            md.Body("coupler", {"C": [0, 0], "B": [0.09, 0]}, number=2),
            md.Body("rocker", {"D": [0, 0], "C": [0.08, 0]}, number=3),
            md.Body("wheel", {"A": [0, 0]}, number=4),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("wheel_pin", "ground.A", "wheel.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
            md.Gear("mesh", "wheel.A", "coupler.B", carrier="crank", ratio=-1),
        ],
    )
    d = np.deg2rad
    guess = {
        "crank": (0.1, 0, d(20)),
        "coupler": (0.07, -0.04, d(40)),
        "rocker": (0, 0, d(-30)),
        "wheel": (0.1, 0, 0),
    }
    values = d([0.0]) if values is None else values
    title = "Geared five-bar: four-bar driven by a wheel coaxial with the crank"
    return make_result(mechanism, "wheel", values, guess, title=title)


def slider_crank(values=POSES):
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "B": [0.1, 0]}),
            md.Body("rod", {"B": [0, 0], "C": [0.3, 0]}),
            md.Body("slider", {"C": [0, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("B", "crank.B", "rod.B"),
            md.Revolute("C", "rod.C", "slider.C"),
            md.Prismatic("slide", "ground.O", "slider.C"),
        ],
    )
    guess = {"crank": (0, 0, 0.3), "rod": (0.1, 0, -0.1), "slider": (0.39, 0, 0)}
    return make_result(mechanism, "crank", values, guess, title="Crank-slider")


def whitworth(values=POSES):
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0], "G": [0, -0.25]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "A": [0.1, 0]}),
            md.Body("arm", {"G": [0, 0], "B": [0.5, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.PinInSlot("slot", "arm.G", "crank.A"),
            md.Revolute("G", "ground.G", "arm.G"),
        ],
    )
    guess = {"crank": (0, 0, 0.3), "arm": (0, -0.25, 1.2)}
    return make_result(mechanism, "crank", values, guess, title="Quick return, pin in slot")


def four_bar(values=POSES):
    mechanism = md.Mechanism(
        ground=md.Ground({"A0": [0, 0], "B0": [0.4, 0]}),
        bodies=[
            md.Body("crank", {"A0": [0, 0], "A": [0.12, 0]}),
            md.Body("coupler", {"A": [0, 0], "B": [0.35, 0], "P": [0.2, 0.16]}),
            md.Body("rocker", {"B0": [0, 0], "B": [0.25, 0]}),
        ],
        joints=[
            md.Revolute("A0", "ground.A0", "crank.A0"),
            md.Revolute("A", "crank.A", "coupler.A"),
            md.Revolute("B", "coupler.B", "rocker.B"),
            md.Revolute("B0", "ground.B0", "rocker.B0"),
        ],
    )
    guess = {"crank": (0, 0, 0.3), "coupler": (0.11, 0.03, 0.6), "rocker": (0.4, 0, 1.5)}
    return make_result(mechanism, "crank", values, guess, title="Four-bar with coupler point")


def planetary(values=POSES):
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0]}),
        bodies=[
            md.Body("sun", {"O": [0, 0]}),
            md.Body("arm", {"O": [0, 0], "P": [0.09, 0]}),
            md.Body("planet", {"P": [0, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "sun.O"),
            md.Revolute("O2", "ground.O", "arm.O"),
            md.Revolute("P", "arm.P", "planet.P"),
            md.Gear("outer", "sun.O", "planet.P", carrier="arm", teeth=[24, 12], mesh="external"),
            md.Gear("ring", "ground.O", "planet.P", carrier="arm", teeth=[48, 12], mesh="internal"),
        ],
    )
    guess = {"sun": (0, 0, 0.3), "arm": (0, 0, 0.1), "planet": (0.09, 0.01, -0.3)}
    return make_result(mechanism, "sun", values, guess, title="Planetary gear")


def sine_mechanism(values=POSES):
    """Crank, block, yoke on a fixed guide; the yoke has one point only."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0], "S": [0.25, 0]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "A": [0.1, 0]}),
            md.Body("block", {"A": [0, 0]}),
            md.Body("yoke", {"S": [0, 0], "T": [0.25, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "block.A"),
            md.Prismatic("cross", "yoke.S", "block.A", axis="pi/2", turn=0),
            md.Prismatic("way", "ground.S", "yoke.T"),
        ],
    )
    guess = {"crank": (0, 0, 0.3), "block": (0.1, 0.03, 0), "yoke": (0.1, 0, 0)}
    return make_result(mechanism, "crank", values, guess, title="Sine mechanism")


def zoo():
    """One joint of each remaining kind, hung on the ground; one pose."""
    mechanism = md.Mechanism(
        ground=md.Ground(
            {
                "O": [0, 0],
                "D": [0.6, 0],
                "W": [-0.4, 0.3],
                "V": [0, 0.5],
                "Q": [0.9, 0.4],
                "T": [-0.4, 0.22],
            }
        ),
        bodies=[
            md.Body("lever", {"L": [-0.25, 0], "O": [0, 0], "M": [0.15, 0], "R": [0.35, 0]}),
            md.Body("link", {"D": [0, 0], "E": [0.2, 0]}),
            md.Body("bracket", {"E": [0, 0], "X": [0, 0.12]}),
            md.Body("pinion", {"W": [0, 0]}),
            md.Body("rack", {"K": [0, 0]}),
            md.Body("pulley", {"W": [0, 0]}),
            md.Body("disc", {"V": [0, 0]}),
            md.Body("cam", {"Q": [0, 0]}),
            md.Body("follower", {"N": [0, 0]}),
            md.Body("hanger", {"M": [0, 0], "H": [0.2, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "lever.O"),
            md.Revolute("M", "lever.M", "hanger.M"),
            md.PinInSlot("groove", "ground.O", "hanger.H", axis="pi/2"),
            md.Revolute("D", "ground.D", "link.D"),
            md.Weld("E", "link.E", "bracket.E", turn=0),
            md.Distance("bar", "lever.R", "link.E", length=0.2),
            md.Revolute("W", "ground.W", "pinion.W"),
            md.Rack("teeth", "pinion.W", "rack.K", radius=0.08),
            md.Prismatic("way", "ground.T", "rack.K"),
            md.Revolute("V", "ground.V", "disc.V"),
            md.Revolute("W2", "ground.W", "pulley.W"),
            md.Belt("belt", "pulley.W", "disc.V", ratio=2.0),
            md.Revolute("Q", "ground.Q", "cam.Q"),
            md.Curve(
                "profile",
                "cam.Q",
                "follower.N",
                x="0.12*cos(s)",
                y="0.08*sin(s)",
                closed=True,
                roller_radius=0.02,
            ),
            md.Prismatic("stem", "ground.Q", "follower.N", axis="pi/2"),
        ],
    )
    d = np.deg2rad
    poses = {
        "lever": (0, 0, d(15)),
        "link": (0.6, 0, d(115)),
        "bracket": (0.5155, 0.1813, d(115)),
        "pinion": (-0.4, 0.3, 0.4),
        "rack": (-0.3, 0.22, 0),
        "disc": (0, 0.5, 0.2),
        "pulley": (-0.4, 0.3, 0.4),
        "cam": (0.9, 0.4, 0),
        "follower": (0.9, 0.5, 0),
        "hanger": (0.1449, 0.0388, d(-136.4)),
    }
    return SimpleNamespace(
        mechanism=mechanism,
        problem="zoo",
        task="task",
        kind="sweep",
        title="All other joints",
        status=np.array(["ok"]),
        bodies={name: SimpleNamespace(angle=np.array([pose[2]])) for name, pose in poses.items()},
        points={
            f"{name}.{point}": SimpleNamespace(
                position=np.array([pose[:2]])
                + turn(pose[2]) @ [mechanism.values()[f"{name}.{point}.{axis}"] for axis in "xy"]
            )
            for name, pose in poses.items()
            for point in list(mechanism.bodies[name].points)[:1]
        },
        joints={},
        drivers={"way.slide": SimpleNamespace(position=np.array([0.1]))},
        summary={},
    )


SAMPLES = {
    "seven-link": seven_link,
    "five-bar": five_bar,
    "slider-crank": slider_crank,
    "whitworth": whitworth,
    "four-bar": four_bar,
    "planetary": planetary,
    "sine": sine_mechanism,
    "others": zoo,
}


def gids(ax):
    return [artist.get_gid() for artist in ax.get_children() if artist.get_gid()]


def with_gid(ax, gid):
    return [artist for artist in ax.get_children() if artist.get_gid() == gid]


def filled(name: str, width: str = "90mm") -> float:
    """Return the share of a picture that the box of a mechanism, its letters and loads covers."""
    axes = md.plot(name, "diagram", width=width, title=False)
    figure = axes.get_figure(root=True)
    figure.canvas.draw()
    rows = []
    for own in (*axes.patches, *axes.lines, *axes.texts):
        if not str(own.get_gid()).startswith(
            ("scale", "note", "axis-", "gravity", "label-gravity")
        ):
            box = own.get_window_extent()
            if box.width + box.height > 0:
                rows.append((box.min, box.max))
    paper = np.array(figure.canvas.get_width_height())
    low, high = (np.clip(np.array(side), 0, paper) for side in zip(*rows, strict=True))
    return float(np.prod(high.max(axis=0) - low.min(axis=0)) / np.prod(paper))
