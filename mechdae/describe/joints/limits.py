"""Joints that move between limits."""

from __future__ import annotations

from collections.abc import Mapping

from mechdae.describe.joints.joint import Joint


def limited(joints: Mapping[str, Joint]) -> list[Joint]:
    """Return the joints that have limits."""
    return [joint for joint in joints.values() if getattr(joint, "limits", None) is not None]
