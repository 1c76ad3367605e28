"""What to know about a motion under forces, below its table."""

from __future__ import annotations

from collections.abc import Collection

from mechdae.results import Event, Result, Units
from mechdae.results.series import Summary
from mechdae.results.tables.events import lift_off, pairs_of_wheels
from mechdae.results.tables.poses import pose_lines

ENDS = {
    "stiff": "load {load} is stiff (S6), its rate is {rate:.3g} 1/s",
    "infeasible": "a dead point at which the laws of time go on (S4), {residual:.6g} is left",
    "stalled": "the step size went to nothing (S7), {step:.1g} s",
    "unbounded": "speeds grow without bound (S7)",
    "jammed": "no accelerations fit the laws of friction ({code})",
    "ambiguous": "the laws of friction do not decide ({code})",
    "impact": "a law of time jumps in its place or its speed (S9)",
    "chatter": "{count} events crowd (F4)",
}
"""What ends a motion before its time, or slows it, in words."""
RUBBING = {
    "reversal": ("the speed of {} vanishes", "the speeds of {} vanish"),
    "stick": ("{} sticks", "{} stick together"),
    "slip": ("{} slips", "{} slip together"),
}
"""Events of dry friction in words: of one pair, and of several in one instant."""
MOST = 12
"""Events, works and named values that are shown."""


def motion_facts(result: Result) -> list[str]:
    """Return the state at the end, counts of work, the energy audit and events."""
    summary = result.summary
    lines = [f"  end       t = {summary['end']:.12g} s"]
    for name, (value, rate) in list(summary["state"].items())[:MOST]:
        si = result.unit("outputs", name, "value")
        shown, over = result.units.of(si), result.units.of(f"{si}/s")
        units = f" {shown.name}, {over.name}" if si else ""
        rate_text = f"   rate {rate * over.factor: .15g}" if rate == rate else ""
        lines.append(f"    {name:10} {value * shown.factor: .15g}{rate_text}{units}")
    for name, value in summary["multipliers"].items():
        if name in result.outputs:
            lines.append(f"    {name:10} {value: .15g}")
    equations = summary["coordinates"], summary["constraints"], summary["eliminated"]
    lines.append(
        "  equations {} coordinates, {} constraints ({} eliminated)".format(*equations)
        + f", {_freedoms(summary['freedoms'])}"
    )
    lines += _mode(summary)
    if summary["superfluous_equations"]:
        count = summary["superfluous_equations"]
        text = f"  redundant {count} equation(s)"
        if summary.get("not_unique"):
            text += f"; reactions of {', '.join(summary['not_unique'])} are not unique"
        lines.append(text)
    lines.append(
        f"  steps     {summary['steps']}, {summary['rejected']} rejected, {summary['rhs']} "
        f"right-hand sides at tolerance {summary['tolerance']:g}"
    )
    lines.append(
        f"  drift     {summary['drift']:.1e} of a length of the mechanism, speeds "
        f"{summary['drift_of_speeds']:.1e}"
    )
    energy = result.scalars["energy"]
    lines.append(
        f"  energy    {energy[0]:.12g} J at first, {energy[-1]:.12g} J at the end; "
        f"balance {result.checks['energy']:.1e} of what moves"
    )
    for name, work in list(result.work.items())[:MOST]:
        lines.append(f"  work      {name}: {work[-1]:.12g} J")
    wheels = pairs_of_wheels(result)
    lines += [_event(event, wheels, result.units) for event in result.events[:MOST]]
    if len(result.events) > MOST:
        lines.append(f"  events    {MOST} of {len(result.events)} shown; --json prints all")
    return lines


def _mode(summary: Summary) -> list[str]:
    """Return the assembly mode, in the words of a sweep."""
    return [f"  mode      {summary['mode']}"] if summary["mode"] else []


def equilibrium_facts(result: Result) -> list[str]:
    """Return stability and small motions of an equilibrium."""
    summary = result.summary
    lines = [
        f"  {summary['stable']}, {_freedoms(summary['freedoms'])}; {summary['residual']:.1e} of "
        f"the loads is left after {summary['iterations']} steps"
    ]
    lines += _mode(summary)
    found = summary["equilibria"]
    if len(found) > 1:
        count = sum(entry["sketched_mode"] for entry in found)
        lines.append(f"  {len(found)} equilibria, {count} on the sketched mode; --json lists them")
    for mode in summary.get("modes", [])[:MOST]:
        real, swing = mode["eigenvalue"]
        shape = ", ".join(f"{name} {value[0]:.4g}" for name, value in mode["shape"].items())
        if swing:
            text = f"{mode['frequency']:.9g} Hz, damping ratio {mode['damping']:.6g}"
        else:
            text = f"exp({real:.9g} t)"
        lines.append(f"  small motion {text}: {shape}")
    return lines


def _freedoms(count: int) -> str:
    return "1 freedom" if count == 1 else f"{count} freedoms"


def _event(event: Event, wheels: Collection[str], units: Units) -> str:
    place = f"t = {event['time']:.12g} s"
    if event["kind"] == "singular":
        what = (
            f"the rank of the constraints drops by {event['rank_drop']}, continued by inertia; "
            "the branch is not unique"
        )
    elif event["kind"] in RUBBING:
        names = event.get("group") or [event.get("load") or event["joint"]]
        what = RUBBING[event["kind"]][len(names) > 1].format(", ".join(names))
    elif "end" in event:
        what = _contact(event, units)
    elif event["kind"] == "lift_off":
        what = f"{lift_off(event, wheels, units)}, until t = {event['until']:.9g} s"
    elif event["kind"] in ENDS:
        what = ENDS[event["kind"]].format(**event)
    else:
        what = f"{event['name']} = {event['value']:g}, going {event['direction']}"
    word = event["kind"].replace("_", " ")
    return f"  {word:9} {place}: {what}"


def _contact(event: Event, units: Units) -> str:
    """Return what happens at a contact of a joint."""
    name = f"joint {event['joint']} ({event['end']})"
    if event["kind"] != "impact":
        return f"{name} " + ("stays closed" if event["kind"] == "contact" else "lets go")
    shown = units.of(f"{event['unit']}/s")
    speeds = [f"{event[way] * shown.factor:.6g} {shown.name}" for way in ("speed", "rebound")]
    unsure = "" if event.get("unique", True) else ", not unique"
    return f"{name} is hit at {speeds[0]}, leaves at {speeds[1]}{unsure}"


MOTION = (pose_lines, lambda result, _: motion_facts(result))
EQUILIBRIUM = (pose_lines, lambda result, _: equilibrium_facts(result))
"""The tables of such tasks, and what to know about them."""
