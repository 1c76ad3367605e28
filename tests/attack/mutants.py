"""Mistakes planted in the package on purpose; the check of random mechanisms must see each.

A mutant says where it is planted, what it changes, on which drawn cases it is tried and a
word of the fault that must be found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

DYADS = (("dyads", 21), ("dyads", 10), ("dyads", 24))
TRIADS = (("triads", 20), ("triads", 17), ("triads", 0))


@dataclass(frozen=True)
class Mutant:
    """One planted mistake; `plant` takes the monkeypatch fixture."""

    name: str
    place: str
    change: str
    seen: str
    cases: tuple
    plant: Callable
    modes: bool = False


MUTANTS: list[Mutant] = []


def mutant(place, change, seen, cases, modes=False):
    def enter(plant):
        name = plant.__name__.replace("_", " ")
        MUTANTS.append(Mutant(name, place, change, seen, tuple(cases), plant, modes))
        return plant

    return enter


def scaled(monkeypatch, name, factor, which):
    """Multiply a rate's right-hand side in the blocks that `which` chooses."""
    from mechdae.kernels.graphs.blocks import BlockGraph

    right = getattr(BlockGraph, name)

    def wrong(self, *args):
        return right(self, *args) * (factor if which(self) else 1.0)

    monkeypatch.setattr(BlockGraph, name, wrong)


# -- rates ---------------------------------------------------------------------------------


@mutant("BlockGraph.first_rate", "velocities of later blocks times 1 - 1e-9", "velocity", DYADS)
def wrong_first_rate(monkeypatch):
    scaled(monkeypatch, "first_rate", 1 - 1e-9, lambda graph: graph.block.x[0] > 0)


@mutant("BlockGraph.second_rate", "gamma of later blocks times 1 + 1e-8", "acceleration", DYADS)
def wrong_gamma(monkeypatch):
    scaled(monkeypatch, "second_rate", 1 + 1e-8, lambda graph: graph.block.x[0] > 0)


@mutant(
    "BlockGraph.second_rate", "gamma of blocks with three and more unknowns times 1 + 1e-8",
    "acceleration", TRIADS,
)  # fmt: skip
def wrong_gamma_of_a_triad(monkeypatch):
    scaled(monkeypatch, "second_rate", 1 + 1e-8, lambda graph: graph.size >= 3)


@mutant(
    "BlockGraph.first_rate", "velocities of blocks with three and more unknowns times 1 - 1e-9",
    "velocity", TRIADS,
)  # fmt: skip
def wrong_first_rate_of_a_triad(monkeypatch):
    scaled(monkeypatch, "first_rate", 1 - 1e-9, lambda graph: graph.size >= 3)


@mutant("in_time", "driver's acceleration left out", "acceleration", DYADS)
def driver_acceleration_left_out(monkeypatch):
    from mechdae.motion.continuation import evaluate

    right = evaluate.in_time

    def wrong(values, speed, acceleration, *more):
        return right(values, speed, 0 * acceleration, *more)

    monkeypatch.setattr(evaluate, "in_time", wrong)


@mutant("Outputs._coriolis", "sign changed", "coriolis", (("dyads", 8), ("dyads", 17)))
def coriolis_turned_round(monkeypatch):
    from mechdae.motion.setup.outputs import Outputs

    right = Outputs._coriolis
    monkeypatch.setattr(
        Outputs, "_coriolis", lambda *args: {name: -part for name, part in right(*args).items()}
    )


@mutant("Spans._found", "swing and stroke one part in a thousand smaller", "truth show", DYADS[2:])
def swing_too_small(monkeypatch):
    from mechdae.motion.kinematics.extremes import Spans

    right = Spans._found

    def wrong(*args):
        found = right(*args)
        return {w: {k: v * 0.999 for k, v in table.items()} for w, table in found.items()}

    monkeypatch.setattr(Spans, "_found", wrong)


# -- bounds --------------------------------------------------------------------------------


def divided(monkeypatch, divisor):
    from mechdae.motion.continuation.output_bounds import OutputBounds

    right = OutputBounds.of_kind

    def wrong(*args):
        bound = right(*args)
        bound /= divisor
        return bound

    monkeypatch.setattr(OutputBounds, "of_kind", wrong)


@mutant("OutputBounds.of_kind", "bounds divided by 100", "bound", DYADS)
def bound_too_small(monkeypatch):
    divided(monkeypatch, 100)


@mutant("OutputBounds.of_kind", "bounds divided by 100", "bound", TRIADS)
def bound_of_a_triad_too_small(monkeypatch):
    divided(monkeypatch, 100)


# -- branches ------------------------------------------------------------------------------


@mutant("Sketched._square", "the mode farthest from the sketch", "off by", DYADS[1:])
def wrong_branch(monkeypatch):
    from mechdae.motion.assembly.nearest_mode import Sketched

    right = Sketched._square
    monkeypatch.setattr(Sketched, "_square", lambda *args: 1e3 - right(*args))


@mutant("Sketched._square", "the mode farthest from the sketch", "off by", TRIADS)
def wrong_branch_of_a_triad(monkeypatch):
    wrong_branch(monkeypatch)


@mutant("AnyPath.proved", "every step counts as proved", "", (("change", 1), ("change", 3)))
def every_step_certified(monkeypatch):
    from mechdae.motion.continuation.any_path import AnyPath

    monkeypatch.setattr(AnyPath, "proved", lambda self, state, test, *_: np.ones(test.shape, bool))


@mutant(
    "AnyPath.proved, Evaluator._good", "every step and every pose counts as certified",
    "where it cannot be", DYADS[:2],
)  # fmt: skip
def every_pose_certified(monkeypatch):
    from mechdae.motion.continuation.evaluate import Evaluator

    every_step_certified(monkeypatch)
    monkeypatch.setattr(
        Evaluator, "_good", lambda self, path, guess, results, *_: np.ones(results[3].shape, bool)
    )


def plain(monkeypatch):
    from mechdae.motion.continuation.evaluate import H_LIMIT, Evaluator

    def converged(self, path, guess, results, *_):
        return path.constants.kappa * results[3] * np.sqrt(results[4]) <= H_LIMIT

    every_step_certified(monkeypatch)
    monkeypatch.setattr(Evaluator, "_good", converged)


@mutant(
    "AnyPath.proved, Evaluator._good",
    "Newton's method that converged is enough, whatever the sign",
    "off by", (("change", 3), ("change", 12)),
)  # fmt: skip
def plain_newton_continuation(monkeypatch):
    plain(monkeypatch)


@mutant(
    "AnyPath.proved, Evaluator._good",
    "Newton's method that converged is enough, whatever the sign",
    "off by", (("saddle", 1), ("saddle", 2)),
)  # fmt: skip
def plain_newton_continuation_of_a_triad(monkeypatch):
    plain(monkeypatch)


def no_sign(monkeypatch):
    """Take away the sign of the determinant alone: each block's is called the right one."""
    from mechdae.motion.continuation.any_path import AnyPath
    from mechdae.motion.continuation.evaluate import Evaluator

    proved, good = AnyPath.proved, Evaluator._good

    def step(self, state, test, det, miss, sign):
        return proved(self, state, test, np.broadcast_to(sign, np.shape(det)), miss, sign)

    def pose(self, path, guess, results, first, places):
        results = list(results)
        results[2] = path.sign_at(places)
        return good(self, path, guess, results, first, places)

    monkeypatch.setattr(AnyPath, "proved", step)
    monkeypatch.setattr(Evaluator, "_good", pose)


# -- change points -------------------------------------------------------------------------


@mutant(
    "Builder._missed", "the expansion at a change point is not compared with solved poses",
    "bound", (("exact", 5420), ("exact", 25169)),
)  # fmt: skip
def expansion_not_compared(monkeypatch):
    from mechdae.motion.cases.hard_steps.crossings.across_change_point import Builder

    monkeypatch.setattr(
        Builder, "_missed", lambda self, carried, s, centre, own: np.zeros(len(own))
    )


@mutant(
    "Builder._missed, Builder._leads_to", "nothing is asked of the way across a change point",
    "velocity", (("exact", 15640), ("exact", 26124)),
)  # fmt: skip
def change_point_not_led_back(monkeypatch):
    from mechdae.motion.cases.hard_steps.crossings.across_change_point import Builder

    expansion_not_compared(monkeypatch)
    monkeypatch.setattr(Builder, "_leads_to", lambda *_: True)


@mutant(
    "ZonePoses.write", "rates next to change points times 1 + 1e-9", "velocity",
    (("exact", 14016), ("exact", 36304)),
)  # fmt: skip
def wrong_rates_next_to_a_change_point(monkeypatch):
    from mechdae.motion.cases.hard_steps.crossings import across_change_point

    right = across_change_point.quintic_rates

    def wrong(*args):
        x, v, a = right(*args)
        return [x, v * (1 + 1e-9), a]

    monkeypatch.setattr(across_change_point, "quintic_rates", wrong)


@mutant(
    "go_back", "change points are crossed from nodes next to them", "acceleration",
    (("exact", 202631), ("exact", 203373)),
)  # fmt: skip
def crossed_from_too_near(monkeypatch):
    from mechdae.motion.cases.hard_steps import obstacles

    monkeypatch.setattr(obstacles, "go_back", lambda *_: [])


# -- labels and modes ------------------------------------------------------------------------


def flipped(monkeypatch):
    from mechdae.motion.assembly.mode_labels import ModeLabels

    right = ModeLabels.of_group

    def wrong(self, group, poses, u):
        labels = right(self, group, poses, u)
        return [text.translate(str.maketrans("+-", "-+")) for text in labels]

    monkeypatch.setattr(ModeLabels, "of_group", wrong)


@mutant("ModeLabels.of_group", "plus and minus exchanged", "by its pose", DYADS[:1], modes=True)
def flipped_label(monkeypatch):
    flipped(monkeypatch)


@mutant("ModeLabels.of_group", "plus and minus exchanged", "by its pose", TRIADS[:1], modes=True)
def flipped_label_of_a_triad(monkeypatch):
    flipped(monkeypatch)


@mutant(
    "Assembler.candidates", "only the first mode is kept", "by trying all", DYADS[:1], modes=True
)
def lost_mode(monkeypatch):
    from mechdae.motion.assembly.assembler import Assembler

    right = Assembler.candidates

    def wrong(self, *args, **keys):
        poses, *rest = right(self, *args, **keys)
        return (poses[:1], *rest)

    monkeypatch.setattr(Assembler, "candidates", wrong)


@mutant(
    "WholeTurns.number", "whole turns are not counted", "have one label", (("gears", 2800),),
    modes=True,
)  # fmt: skip
def whole_turns_forgotten(monkeypatch):
    from mechdae.motion.assembly.turns.block_turns import WholeTurns

    monkeypatch.setattr(WholeTurns, "number", lambda self, i, x, u: 0)


@mutant(
    "GearedTurns.told", "the block's own unknown decides about whole turns", "off by",
    (("gears", 25642),),
)  # fmt: skip
def whole_turns_by_declaration(monkeypatch):
    from mechdae.motion.cases.meshes.turn_lattice import GearedTurns

    monkeypatch.setattr(GearedTurns, "told", lambda self, i: [])


@mutant(
    "Evaluator.returns", "all groups count as back after a whole turn", "beyond its limit",
    (("gears", 1907),),
)  # fmt: skip
def planet_always_back(monkeypatch):
    from mechdae.motion.continuation.evaluate import Evaluator

    monkeypatch.setattr(
        Evaluator, "returns",
        lambda self, path, guess, s, shifted: np.ones((len(s), len(self.groups)), bool),
    )  # fmt: skip


@mutant(
    "Evaluator._turn_round, sweep.cover",
    "each group for itself may be reached by turning the other way round",
    "where it cannot be",
    (("parallel", 18), ("parallel", 25), ("parallel", 39)),
)
def each_group_on_its_own_way(monkeypatch):
    from mechdae.motion.continuation.evaluate import Evaluator
    from mechdae.motion.continuation.follower import extend
    from mechdae.motion.kinematics import sweep

    def at(self, path, s, rates=()):
        s, count = np.asarray(s, float), len(self.graphs.driven)
        nothing = np.zeros((len(s), self.graphs.nu))
        rates = tuple([*(rates or path.rates(s, count)), *[nothing] * count][:count])
        alive = path.follows(s)
        guess = path.guess(s)
        for j, group in enumerate(self.groups) if path.graphs.turns else ():
            reach, rows = path.reach[group], np.flatnonzero(~alive[:, j])
            first = reach.low.s if reach.low else path.s[0]
            last = reach.high.s if reach.high else path.s[-1]
            there = s[rows] + 2 * np.pi * np.ceil((first - s[rows]) / (2 * np.pi))
            kept = reach.contains(there) & (there <= last) & (there != s[rows])
            rows, there = rows[kept], there[kept]
            if rows.size:
                columns = np.flatnonzero(self.column_group == j)
                guess[np.ix_(rows, columns)] = path.guess(there)[:, columns]
                alive[rows, j] = self.returns(path, guess[rows], s[rows], there)[:, j]
        self.carry(~alive, alive)
        poses = self._solve(path, s, s, guess, alive, self.limits(path, s), rates)
        poses.singular = self.stops(path, s) & ~poses.alive.all(axis=1)
        return poses

    def cover(path, evaluator, values, is_angle, corners=()):
        extend(path, float(np.max(values)))
        extend(path, float(np.min(values)))
        for group, reach in path.reach.items() if is_angle else ():
            if (reach.low is None) != (reach.high is None) and not reach.contains(values).all():
                anchor, turn = (
                    (reach.low.s, 2 * np.pi) if reach.low is not None else
                    (reach.high.s, -2 * np.pi)
                )  # fmt: skip
                extend(path, anchor + turn, needed=[group])

    monkeypatch.setattr(Evaluator, "at", at)
    monkeypatch.setattr(sweep, "cover", cover)


# -- limits --------------------------------------------------------------------------------


def swallow(monkeypatch):
    from mechdae.motion.continuation.follower import Front

    monkeypatch.setattr(Front, "end", lambda self, limit: self.ended.update(self.path.groups))


@mutant("Front.end", "a limit ends the path and is not recorded", "limit", DYADS)
def swallowed_limit(monkeypatch):
    swallow(monkeypatch)


@mutant("Front.end", "a limit ends the path and is not recorded", "limit", TRIADS)
def swallowed_limit_of_a_triad(monkeypatch):
    swallow(monkeypatch)


@mutant(
    "FoldApproach._proved",
    "every step into a limit position counts as proved",
    "limit",
    (("triads", 2959), ("triads", 29737)),
)
def hidden_limit(monkeypatch):
    from mechdae.motion.cases.hard_steps.fold_approach import FoldApproach

    monkeypatch.setattr(FoldApproach, "_proved", lambda *args: True)


def shift(monkeypatch):
    from mechdae.motion.continuation.follower import Front

    right = Front.end

    def wrong(self, limit):
        return right(self, replace(limit, s=limit.s + self.sense * 1e-10))

    monkeypatch.setattr(Front, "end", wrong)


@mutant("Front.end", "limits moved by 1e-10", "limit", DYADS)
def moved_limit(monkeypatch):
    shift(monkeypatch)


@mutant("Front.end", "limits moved by 1e-10", "limit", TRIADS)
def moved_limit_of_a_triad(monkeypatch):
    shift(monkeypatch)


@mutant(
    "Evaluator.put_limit",
    "the pose at a limit moved by 1e-5",
    "at the limit",
    (("end", 6), ("end", 12)),
)
def moved_pose_at_a_limit(monkeypatch):
    from mechdae.motion.continuation.evaluate import Evaluator

    right = Evaluator.put_limit

    def wrong(self, path, k, s, limits, alive, results):
        moved = [replace(limit, x=limit.x + 1e-5 * limit.v) for limit in limits]
        return right(self, path, k, s, moved, alive, results)

    monkeypatch.setattr(Evaluator, "put_limit", wrong)


# -- joints --------------------------------------------------------------------------------


@mutant("Belt.sense", "crossed belts taken for open ones", "off by", (("gears", 0), ("gears", 11)))
def belt_not_crossed(monkeypatch):
    from mechdae.describe.joints.wheels import Belt

    monkeypatch.setattr(Belt, "sense", property(lambda self: 1))


@mutant(
    "Ends.carrier_angle", "carriers taken for the ground", "off by", (("gears", 4), ("gears", 17))
)
def carrier_forgotten(monkeypatch):
    from mechdae.equations.joints import Ends, ca

    monkeypatch.setattr(Ends, "carrier_angle", property(lambda self: ca.SX(0)))


@mutant("residuals.rack", "the rack runs the other way", "off by", (("gears", 6), ("gears", 16)))
def rack_reversed(monkeypatch):
    from mechdae.equations import joints

    right = joints.rack

    def wrong(ends):
        ((name, row, unit),) = right(ends)
        number = ends.number("radius") * (ends.first.angle - ends.carrier_angle)
        return [(name, row + 2 * number, unit)]

    monkeypatch.setitem(joints.RESIDUALS, "rack", (wrong,))
