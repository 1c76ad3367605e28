"""Joints that move between limits, or in gaps."""

from __future__ import annotations

from collections.abc import Mapping

from mechdae.describe.joints.joint import GAPS, Joint


def limited(joints: Mapping[str, Joint]) -> list[Joint]:
    """Return the joints that have limits."""
    return [joint for joint in joints.values() if getattr(joint, "limits", None) is not None]


def with_gaps(joints: Mapping[str, Joint], values: Mapping[str, float]) -> list[str]:
    """Return the joints that have a gap."""
    return [name for name in joints if any(values.get(f"{name}.{key}", 0.0) for key in GAPS)]


def in_gaps(joints: Mapping[str, Joint], values: Mapping[str, float]) -> list[str]:
    """Return the joints that may move in a gap: it is given, with a restitution."""
    return [name for name in with_gaps(joints, values) if f"{name}.restitution" in values]
