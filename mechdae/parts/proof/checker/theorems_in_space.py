"""How many poses groups of bodies in space have at most: theorems of the field."""

from __future__ import annotations

from flint import arb

from .arithmetic import Json, need
from .counts import Theorems, group_columns
from .space import TURNS, VECTOR, SpatialMechanism, dot


def most_in_space(m: SpatialMechanism, group: list[str], known: set[str]) -> tuple[int, str]:
    """Return how many complex poses a group has at most, and by which theorem of the field."""
    new = {*group} - known
    need(len(new) == len(group) > 0, "groups", f"no bodies, or one stands there twice: {group}")
    joints = m.joints_of(group, known)
    kinds = sorted(joint["kind"] for joint in joints.values())
    drivers = [name for name in m.drivers if name.split(".")[0] in {*joints, *group}]
    if {*kinds} == {"vector"}:
        count, theorem = _most_of_vectors(joints, drivers, len(new))
    else:
        count, theorem = (
            _most_of_one(m, joints, kinds, drivers, known) if len(new) == 1 else (0, "")
        )
    if count:
        return count, theorem
    left_out = {m.kinds[k] for k in m.left_out} & {*kinds}
    if drivers or left_out:
        return 0, f"no theorem here tells how many poses {group} has"
    return _most_of_several(m, joints, new, known)


def _most_of_vectors(joints: Json, drivers: list[str], count: int) -> tuple[int, str]:
    """Return how many ways a loop of vectors closes in, 0 where it has not three unknowns."""
    free = [
        "".join(word[0] for word in joint["unknown"] if f"{name}.{word}" not in drivers)
        for name, joint in joints.items()
    ]
    if len(joints) == count and not any(free):
        return 1, ""
    if len(joints) != count + 1 or len("".join(free)) != 3:
        return 0, ""
    circles = sum(word in ("e", "a", "ea", "la") for word in free)  # spheres and cones are, too
    level = sum(word in ("a", "la") for word in free)
    half = level > 1 or (circles == 2 and "ea" in free)
    return 2**circles // (2 if half else 1), "Bezout"


def _most_of_one(
    m: SpatialMechanism, joints: Json, kinds: list[str], drivers: list[str], known: set[str]
) -> tuple[int, str]:
    """Return how many poses one body has, 0 where no theorem tells."""
    left_out = {m.kinds[k] for k in m.left_out}
    if kinds in (["revolute"], ["prismatic"], ["screw"]) and len(drivers) == 1:
        return 1, ""
    if kinds == ["prismatic", "screw"] and not drivers and left_out <= {"screw"}:
        return 1, ""
    if kinds == ["distance"] * 6 and not drivers and not left_out & {*kinds}:
        return 40, "Ronga and Vust 1995"
    if kinds == ["weld"] or (
        kinds == ["revolute"] and not drivers and _is_geared(m, joints, known)
    ):
        return 1, ""
    if kinds in (["distance", "prismatic"], ["distance", "revolute"]) and not drivers:
        return 2, "a sphere and a circle or line"
    if kinds == ["revolute", "universal"] and not drivers and left_out <= {"universal"}:
        return 2, "sine and cosine"
    return 0, ""


def _is_geared(m: SpatialMechanism, joints: Json, known: set[str]) -> bool:
    """Whether a sum links coordinates of the joints to those of known bodies alone."""
    for terms in m.sums.values():
        owners = {name.split(".")[0] for name in terms if name}
        others = owners - {*joints}
        if owners & {*joints} and all({*m.joints[name]["bodies"]} <= known for name in others):
            return True
    return False


def _most_of_several(
    m: SpatialMechanism, joints: Json, new: set[str], known: set[str]
) -> tuple[int, str]:
    """Return how many complex poses two or five bodies have at most, 0 where no theorem tells."""
    spots = {
        body: [m.points[b][p] for j in joints.values() for b, p in j["ends"] if b == body]
        for body in new
    }
    meet = {body for body, places in spots.items() if places[1:] == places[:-1]}
    """Bodies whose joints are in one point."""
    ordered = sorted((j["kind"], k, {*j["bodies"]}) for k, j in enumerate(joints.values()))
    kinds, sides = [kind for kind, *_ in ordered], [side for *_, side in ordered]
    first = {body for side in sides if side & known for body in side}
    if kinds == ["revolute"] * 6 and len(new) == 5:  # axes of three at one end may meet in a point
        pieper = any(side <= meet and side & first for side in sides)
        return (8, "Pieper 1968") if pieper else (16, "Primrose 1986, Lee and Liang 1988")
    inner = {bool(side & known) for side in sides[-2:]} == {True, False}
    if kinds in (["distance", k, "spherical", "spherical"] for k in ("prismatic", "revolute")):
        hub = new - sides[1]
        if len(hub) == 1 and hub <= sides[0] & sides[2] & sides[3] and inner:
            return 4, "circle and sphere, twice"
    if kinds == ["cylindrical", "universal", "universal"] and len(new) == 2 and inner:
        shaft = new & sides[0]
        if len(shaft) == 1 and shaft <= meet and not shaft <= sides[1] & sides[2]:
            return 8, "line and sphere, sine and cosine, twice"
    return 0, f"no theorem here tells how many poses {sorted(new)} have"


def alike_in_space(
    m: SpatialMechanism, groups: list[list[str]], one: list[arb], other: list[arb]
) -> bool:
    """Whether two poses in balls may be one, whole turns and signs of quaternions aside.

    Theorems count the poses of a group for one pose of those before it. Where wheels tell whole
    turns of these, or a screw its own, poses with other turns of them are not counted twice.
    """
    counted = {term for terms in m.sums.values() for term in terms}
    for columns in group_columns(m, groups):
        screws = [k for k in columns if _is_of_screw(m, *m.names[k])]
        if not all(_may_be_equal(m, k, one, other) for k in screws or columns):
            return False
        turning = [k for k in columns if ".".join(m.names[k]) in counted or k in screws]
        if not all((one[k] - other[k]).contains(0) for k in turning):
            return True
    return True


def _is_of_screw(m: SpatialMechanism, owner: str, word: str) -> bool:
    return not m.is_of_body(word) and m.joints[owner]["kind"] == "screw"


def _may_be_equal(m: SpatialMechanism, k: int, one: list[arb], other: list[arb]) -> bool:
    """Whether a coordinate may be the same in two poses, whole turns and signs aside."""
    word = m.names[k][1]
    if word in "123":
        return True  # seen with the quaternion's first entry
    if word == "0":  # products of two unit quaternions that are one or opposite are +-1
        return bool((dot(one[k : k + 4], other[k : k + 4]) ** 2 - 1).contains(0))
    off = (one[k] - other[k]) / 2
    return bool((off.sin() if word in (*TURNS, *VECTOR[1:]) else off).contains(0))


def aside_in_space(m: SpatialMechanism, groups: list[list[str]], theorems: list[str]) -> str:
    """Return what poses of groups are counted without."""
    screws = [name for name, joint in m.joints.items() if joint["kind"] == "screw"]
    free = any(f"{name}.angle" not in m.drivers for name in screws)
    wheels = any(theorems) and m.sums
    return ", turns of screws aside" * free + ", whole turns that wheels would tell aside" * bool(
        wheels
    )


IN_SPACE = Theorems(most_in_space, alike_in_space, aside_in_space)
