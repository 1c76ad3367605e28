"""Which part lies where: plates in layers, pins through them, spacers between."""

from __future__ import annotations

from dataclasses import dataclass

from mechdae.describe import GROUND
from mechdae.describe.layers import Layers, LinksCrossing, fewest_layers
from mechdae.errors import UnavailableError
from mechdae.parts.exchange.workshop.apart import Meeting, Motions, all_pairs, meetings, shapes_of
from mechdae.parts.exchange.workshop.plates import Kit


@dataclass(frozen=True)
class Stack:
    """Layers of all plates, with what keeps two of them out of the same one.

    Attributes
    ----------
    layers
        Layer of each plate that moves; the frame is in layer 0 and, with ``front``, in the last.
    pins
        First and last layer of each pin.
    spacers
        Rings of each pin between its plates: the layers that they fill.
    meetings
        Plates, and plates and pins of others, that are not proved apart over the motion.
    """

    layers: dict[str, int]
    pins: dict[str, tuple[int, int]]
    spacers: dict[str, list[int]]
    front: int | None
    meetings: list[Meeting]


def stacked(motions: Motions, kit: Kit) -> Stack:
    """Return layers in which no part meets another one over the whole motion.

    Raises
    ------
    UnavailableError
        No order of layers lets all plates pass; with a pair that meets.
    """
    plates, pins = shapes_of(motions, kit)
    apart, over = all_pairs(kit, plates, pins)
    met = meetings(motions, [*apart, *over], kit.sizes.air)
    names = list(kit.moving)
    crossed = frozenset(frozenset((m.one, m.other)) for m in met if m.other in plates)
    passed = frozenset((m.one, m.other) for m in met if m.other in pins)
    pairs = {pin.name: pin.plates for pin in kit.pins.values()}
    found = fewest_layers(pairs, {}, LinksCrossing(tuple(names), crossed, passed))
    if isinstance(found, str):
        worst = next((m for m in met if m.other in pins), None)
        hint = f"{worst.one} passes over {worst.other}" if worst else ""
        raise UnavailableError(found, where="bodies", hint=hint)
    return _stack(kit, found, met)


def _stack(kit: Kit, found: Layers, met: list[Meeting]) -> Stack:
    layers = {name: low for name, (low, _) in found.spans.items()}
    top = max(layers.values())
    shafts: dict[str, tuple[int, int]] = {}
    spacers: dict[str, list[int]] = {}
    for pins in kit.shafts:
        name = pins[0]
        first = min(found.pins[pin][0] for pin in pins)
        last = max(found.pins[pin][1] for pin in pins)
        held = {layers[plate] for plate in kit.on_shaft(pins) if plate != GROUND}
        shafts[name] = first, last
        inside = [layer for layer in range(first + 1, last) if layer not in held]
        if inside:
            spacers[name] = inside
    front = top + 1 if any(last > top for _, last in shafts.values()) else None
    return Stack(layers, shafts, spacers, front, met)
