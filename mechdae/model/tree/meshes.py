"""Which joints carry the wheels of a gear in space."""

from __future__ import annotations

from mechdae.describe.joints import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.errors import MechanismError


def bearings(mechanism: Mechanism, gear: Joint) -> list[tuple[str, float]]:
    """Return for both wheels the joint they turn in on the carrier, and the sense of its angle."""
    carrier = getattr(gear, "carrier", None) or GROUND
    found = []
    for wheel in (gear.first_body, gear.second_body):
        own = [
            (joint.name, 1.0 if joint.second_body == wheel else -1.0)
            for joint in mechanism.joints.values()
            if {joint.first_body, joint.second_body} == {wheel, carrier}
            and "angle" in joint.coordinates
        ]
        if len(own) != 1:
            raise MechanismError(
                f"wheel {wheel} needs one joint with an angle on the carrier {carrier}",
                where=f"joints.{gear.name}",
            )
        found += own
    return found
