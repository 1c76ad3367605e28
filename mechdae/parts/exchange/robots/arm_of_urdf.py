"""`arm_from_urdf`: an arm with six turning axes from a URDF file."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from mechdae.errors import InputError, UnknownName
from mechdae.numerics.arms.chain import AXES, Arm, arm_of_axes
from mechdae.types import Floats, Matrix

TURNS = ("revolute", "continuous")
TWELFTH = math.pi / 12
DIGITS = 4
"""Angles written with so many decimals at least, and equal to a multiple of 15 degrees in these,
are that multiple: axes that are parallel, or meet, do so exactly then."""


def arm_from_urdf(path: str | Path, base: str = "", tip: str = "") -> Arm:
    """Return the arm between two links of a URDF file, with the limits of its joints.

    Parameters
    ----------
    path
        The file.
    base, tip
        Names of the links between which six joints turn: by default the root, and the only link
        behind six such joints without any behind it.

    Returns
    -------
    Arm
        Six axes, with the names and limits of the file.

    Raises
    ------
    InputError
        The file cannot be read, or is no URDF; joints on the way slide; they are not six.
    UnknownName
        No such link.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> links = [f'<link name="l{k}"/>' for k in range(7)]
    >>> joint = '<joint name="j{0}" type="continuous"><parent link="l{0}"/><child link="l{1}"/>'
    >>> turn = '<origin xyz="0.3 0 0.1" rpy="1.2 0 0.4"/><axis xyz="0 0 1"/></joint>'
    >>> joints = [joint.format(k, k + 1) + turn for k in range(6)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "arm.urdf")
    ...     _ = path.write_text(f"<robot name='r'>{''.join(links + joints)}</robot>")
    ...     md.arm_from_urdf(path).links.shape
    (6, 3)
    """
    where = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read: {error}", where=where) from None
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise InputError(f"no XML: {error}", where=where) from None
    if root.tag != "robot":
        raise InputError("no URDF: its root is no <robot>", where=where)
    if "xacro" in text and root.find("joint") is None:
        raise InputError("a xacro file", where=where, hint="xacro FILE > arm.urdf writes the URDF")
    above = {_name(j, "child", where): j for j in root.findall("joint")}
    links = [link.get("name", "") for link in root.findall("link")]
    for name in (base, tip):
        if name and name not in links:
            raise UnknownName("link", name, links, where=where)
    roots = [link for link in links if link not in above]
    start = base or (roots[0] if roots else "")
    chain = _way(above, start, tip, where) if tip else _only_way(above, links, start, where)
    turning = [joint for joint in chain if joint.get("type") in TURNS]
    for joint in chain:
        kind = joint.get("type", "")
        if kind not in (*TURNS, "fixed") or joint.find("mimic") is not None:
            what = f"is {kind}" if joint.find("mimic") is None else "follows another one"
            raise InputError(f"joint {joint.get('name')} {what}: six turning ones are needed",
                             where=where, hint="base and tip name the links between")  # fmt: skip
    if len(turning) != AXES:
        names = ", ".join(joint.get("name", "") for joint in turning)
        raise InputError(f"{len(turning)} joints turn ({names}): six are needed", where=where,
                         hint="base and tip name the links between")  # fmt: skip
    place, points, axes = np.eye(4), [], []
    for joint in chain:
        place = place @ _origin(joint, where)
        if joint in turning:
            element = joint.find("axis")
            given = "1 0 0" if element is None else element.get("xyz", "1 0 0")
            points.append(place[:3, 3])
            axes.append(place[:3, :3] @ _numbers(given, joint, where))
    limits = np.array([_limits(joint, where) for joint in turning])
    every = [joint.get("name", "") for joint in turning]
    return arm_of_axes(points, axes, place, limits, every)


def _name(joint: ET.Element, tag: str, where: str) -> str:
    element = joint.find(tag)
    if element is None or not element.get("link"):
        raise InputError(f"joint {joint.get('name')} has no {tag}", where=where)
    return str(element.get("link"))


def _way(above: dict[str, ET.Element], start: str, tip: str, where: str) -> list[ET.Element]:
    """Return the joints from a link to another one, outwards."""
    chain: list[ET.Element] = []
    link = tip
    while link != start:
        joint = above.get(link)
        if joint is None or joint in chain:
            raise InputError(f"{tip} does not hang on {start}", where=where)
        chain.append(joint)
        link = _name(joint, "parent", where)
    return chain[::-1]


def _only_way(
    above: dict[str, ET.Element], links: list[str], start: str, where: str
) -> list[ET.Element]:
    """Return the joints to the one link behind six turning joints, which has none behind it."""
    parents = {_name(joint, "parent", where) for joint in above.values()}
    ways: dict[str, list[ET.Element]] = {}
    for tip in links:
        if tip not in parents:
            chain = _way(above, start, tip, where)
            if sum(joint.get("type") in TURNS for joint in chain) == AXES:
                ways[tip] = chain
    moving = {tuple(j for j in chain if j.get("type") != "fixed") for chain in ways.values()}
    if len(ways) == 1:
        return next(iter(ways.values()))
    if not ways:
        raise InputError(f"no end behind six turning joints from {start}", where=where,
                         hint="base and tip name the links between")  # fmt: skip
    several = "the same" if len(moving) == 1 else "six turning"
    raise InputError(f"{len(ways)} ends are behind {several} joints: {', '.join(ways)}",
                     where=where, hint="tip names the one that is meant")  # fmt: skip


def _numbers(text: str, joint: ET.Element, where: str) -> Floats:
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise InputError(f"joint {joint.get('name')}: '{text}' are not three numbers", where=where)
    return values


def _exact(word: str) -> float:
    """Return an angle, the multiple of 15 degrees that it is to the digits written."""
    value = float(word)
    decimals = len(word.lower().partition("e")[0].partition(".")[2])
    multiple = round(value / TWELFTH) * TWELFTH
    written = "e" not in word.lower() and decimals >= DIGITS
    return multiple if written and abs(value - multiple) <= 10.0**-decimals else value


def _origin(joint: ET.Element, where: str) -> Matrix:
    """Return the place of a joint's frame in that of its parent."""
    place, element = np.eye(4), joint.find("origin")
    if element is None:
        return place
    place[:3, 3] = _numbers(element.get("xyz", "0 0 0"), joint, where)
    text = element.get("rpy", "0 0 0")
    _numbers(text, joint, where)
    for axis, word in enumerate(text.split()):
        c, s = math.cos(_exact(word)), math.sin(_exact(word))
        i, j, turn = (axis + 1) % 3, (axis + 2) % 3, np.eye(3)
        turn[i, i] = turn[j, j] = c
        turn[i, j], turn[j, i] = -s, s
        place[:3, :3] = turn @ place[:3, :3]
    return place


def _limits(joint: ET.Element, where: str) -> tuple[float, float]:
    if joint.get("type") == "continuous":
        return -math.inf, math.inf
    element = joint.find("limit")
    words = (None, None) if element is None else (element.get("lower"), element.get("upper"))
    try:
        low, high = float(words[0] or 0.0), float(words[1] or 0.0)
    except ValueError:
        low = high = math.nan
    if element is None or math.isnan(low) or math.isnan(high):
        raise InputError(f"joint {joint.get('name')} has no limits", where=where,
                         hint="type continuous needs none")  # fmt: skip
    return low, high
