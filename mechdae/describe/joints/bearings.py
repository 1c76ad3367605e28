"""Which joints carry the wheels and racks of a mesh in space."""

from __future__ import annotations

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.errors import MechanismError
from mechdae.records import dataclass


@dataclass(frozen=True)
class Bearing:
    """The joint of a wheel or rack on the carrier, its coordinate, and the sense it counts in."""

    joint: str
    word: str
    sense: float


def bearings(mechanism: Mechanism, mesh: Joint) -> list[Bearing]:
    """Return for both members of a mesh the joint in which they move on the carrier."""
    carrier = getattr(mesh, "carrier", None) or GROUND
    found = []
    for member, wheel in ((mesh.first_body, True), (mesh.second_body, mesh.wheels > 1)):
        word, name = ("angle", "wheel") if wheel else ("slide", "rack")
        chosen = [
            Bearing(joint.name, word, 1.0 if joint.second_body == member else -1.0)
            for joint in mechanism.joints.values()
            if {joint.first_body, joint.second_body} == {member, carrier}
            and word in joint.coordinates
        ]
        if len(chosen) != 1:
            raise MechanismError(
                f"{name} {member} needs one joint with {'an' if wheel else 'a'} {word} on the "
                f"carrier {carrier}",
                where=f"joints.{mesh.name}",
                hint=f"a joint between {carrier} and {member}, or another carrier",
            )
        found += chosen
    return found
