"""A task's scene with all that is needed to evaluate it, kept for other numbers.

Models and kernels of the structures that were used last are kept, bounded in number and in size. A
structure that someone else still holds is found again too.
"""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.structure import structure_of
from mechdae.describe.tasks.kinds import Sweep
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene, groups_of, model_of, scene
from mechdae.equations.structure_cache import StructureCache
from mechdae.errors import FreedomError, SolveError, UnavailableError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.numpy_backend import CACHE_BYTES, NumpyFunction
from mechdae.motion.assembly import not_assembled, start
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.idle_freedom import coarser
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.evaluate import Evaluator, Poses
from mechdae.motion.kinematics.extremes import Spans
from mechdae.motion.measures.measured import Measured
from mechdae.motion.setup.drivers import DriverPlan, plan, sketched
from mechdae.motion.setup.likely_typos import driver_slips
from mechdae.motion.setup.outputs import Outputs, Request
from mechdae.motion.setup.scales import Constants, divisors, driver_size
from mechdae.records import dataclass
from mechdae.results import Summary
from mechdae.types import Booleans, Floats, Json, Unknowns

MOST = 16
"""Structures that are kept."""
MOST_BYTES = 256_000_000
"""Estimated size of all of them: instructions of kernels, and buffers of those for many poses."""
PER_INSTRUCTION = 400
"""Bytes of an instruction of a kernel: casadi's own, and those of its NumPy form."""

T = TypeVar("T")


class Sized(Protocol):
    """What was built for a structure."""

    @property
    def size(self) -> int:
        """Estimated bytes."""


class CacheOwner:
    """The structures that someone used last, who thereby keeps them.

    ``free`` are numbers that stay symbols in them even where they are zero.
    """

    def __init__(self, free: frozenset[str] = frozenset()) -> None:
        self.free = free
        self._latest: Any = None
        self._last: OrderedDict[Hashable, Any] = OrderedDict()

    def use(self, key: Hashable, shape: object) -> None:
        """Keep a structure, in the place of the one used longest ago."""
        if self._latest is shape:
            return
        self._latest = shape
        self._last[key] = shape
        self._last.move_to_end(key)
        while len(self._last) > MOST:
            self._last.popitem(last=False)


_HOLDER: ContextVar[CacheOwner | None] = ContextVar("holder", default=None)


class Shapes(Generic[T]):
    """What was built for structures, the least recently used forgotten first.

    Parameters
    ----------
    most, most_bytes
        How many are kept, and how much they may be by `size_of`.
    size_of
        Estimated size in bytes; it may grow while a structure is used.
    """

    def __init__(
        self, size_of: Callable[[T], int], most: int = MOST, most_bytes: int = MOST_BYTES
    ) -> None:
        self.size_of, self.most, self.most_bytes = size_of, most, most_bytes
        self._last: OrderedDict[Hashable, T] = OrderedDict()
        self._living: weakref.WeakValueDictionary[Hashable, Any] = weakref.WeakValueDictionary()
        self._latest: T | None = None
        self._lock = threading.Lock()

    def get(self, key: Hashable) -> T | None:
        """Return what is kept under a key, None where nothing is."""
        with self._lock:
            found: T | None = self._living.get(key)
            if found is not None:
                self._use(key, found)
            return found

    def put(self, key: Hashable, shape: T) -> None:
        """Keep something under a key, in the place of what was there."""
        with self._lock:
            self._living[key] = shape
            self._use(key, shape)

    def _use(self, key: Hashable, shape: T) -> None:
        holder = _HOLDER.get()
        if holder is not None:
            holder.use(key, shape)
        if self._latest is shape:
            return
        self._latest = shape
        self._last[key] = shape
        self._last.move_to_end(key)
        sizes = [self.size_of(values) for values in self._last.values()]
        count = len(sizes)
        while count > self.most or (count > 1 and sum(sizes[-count:]) > self.most_bytes):
            self._last.popitem(last=False)
            count -= 1

    def values(self) -> list[T]:
        """Return what is kept, that used last at the end."""
        with self._lock:
            return list(self._last.values())

    def clear(self) -> None:
        """Forget everything; who holds a structure keeps it, but it is not found again."""
        with self._lock:
            self._living.clear()
            self._last.clear()
            self._latest = None

    def __len__(self) -> int:
        return len(self._last)


@contextmanager
def keep_for(holder: CacheOwner) -> Iterator[None]:
    """Let `holder` keep the structures that are used meanwhile."""
    token = _HOLDER.set(holder)
    try:
        yield
    finally:
        _HOLDER.reset(token)


def free_numbers() -> frozenset[str]:
    """Return the numbers that the holder of this thread wants as symbols."""
    holder = _HOLDER.get()
    return holder.free if holder is not None else frozenset()


def size_of(*caches: StructureCache) -> int:
    """Return the estimated bytes of kernels."""
    known = caches[0]("size", lambda: [0, 0])  # how many things were counted, and their size
    contents = [made for cache in caches for made in cache.contents()]
    if known[0] != len(contents):
        functions = [getattr(made, "function", made) for made in contents]
        sizes: list[int] = [f.n_instructions() for f in functions if hasattr(f, "n_instructions")]
        lines = sum(isinstance(made, NumpyFunction) for made in contents)
        lines += sum(bool(getattr(made, "lines", ())) for made in contents)
        known[:] = len(contents), PER_INSTRUCTION * sum(sizes) + CACHE_BYTES * lines
    return int(known[1])


GROWTHS = 8
SAFE = 0.75
"""Share of a divisor's least size at the nodes of a path that it may keep between them."""
if TYPE_CHECKING:
    from mechdae.motion.setup.named_outputs import NamedOutputs

P = TypeVar("P", bound=AnyPath)
"""A line or course, or legs."""


@dataclass(frozen=True)
class Shape:
    """What a task's structure decides: model, equations, kernels; shared by all its numbers."""

    scene: Scene
    outputs: Outputs
    graphs: Graphs
    expressions: NamedOutputs | None
    loaded: tuple[str, ...] | None
    coarse: bool

    @property
    def size(self) -> int:
        """Estimated bytes of its kernels."""
        return size_of(self.scene.model.cache, self.scene.cache, self.graphs.cache)

    def at(self, mechanism: Mechanism, plan: DriverPlan, on_change_point: str) -> Setting:
        """Return the setting of a mechanism of this structure."""
        return self.of(self.scene.model.at(mechanism), plan, on_change_point)

    def of(self, model: Model, plan: DriverPlan, on_change_point: str) -> Setting:
        """Return the setting of a copy of the shape's model with other numbers."""
        the_scene = self.scene.at(model)
        graphs = self.graphs.at(the_scene)
        assembler = Assembler(graphs, sketched(model.mechanism))
        outputs = self.outputs.at(the_scene)
        expressions = self.expressions.at(model) if self.expressions is not None else None
        return Setting(
            plan, the_scene, outputs, graphs, assembler, expressions, on_change_point, self
        )


@dataclass
class Setting:
    """The numbers of a task with the shape they belong to: ready to be evaluated."""

    plan: DriverPlan
    scene: Scene
    outputs: Outputs
    graphs: Graphs
    assembler: Assembler
    expressions: NamedOutputs | None
    on_change_point: str
    shape: Shape
    notes: list[str] = field(default_factory=list)
    doubts: Callable[[], list[str]] = list
    """Gives notes on the first pose, which only those who read them wait for."""

    @property
    def driver_sizes(self) -> Floats:
        """The size of each driver (nd,), see `driver_size`."""
        model, length = self.scene.model, self.scene.model.mechanism.scale
        return np.array([driver_size(model, c, length) for c in self.plan.coordinates])


SHAPES: Shapes[Sized] = Shapes(lambda shape: shape.size)
"""The structures used last, by what decides them."""


@dataclass
class Run:
    """Evaluated poses with the driver values and the places on the path they belong to."""

    path: AnyPath
    evaluator: Evaluator
    poses: Poses
    values: Floats
    places: Any
    events: list[Json]
    summary: Summary
    found: Measured = field(default_factory=Measured)
    spans: Spans | None = None
    stopped: Booleans | bool = False
    """Poses (n,) with a joint beyond its limits, of which `fault` says so."""
    fault: str | None = None

    @property
    def start(self) -> tuple[Floats, Floats]:
        """Unknowns and driver values of the pose the path starts from."""
        s, x = self.path.origin
        return x, self.path.drivers(np.array([s]))[0]


def prepare(
    problem: Problem,
    task: Sweep,
    loaded: Callable[[Model], Iterable[str]] | None = None,
    more: Callable[[Scene], list[Request]] | None = None,
    free: Iterable[str] = (),
) -> Setting:
    """Return scene and kernels of a task; only redundant groups are assembled yet.

    A task of forces names the bodies that are `loaded`, and what `more` is evaluated; numbers
    that are `free` stay symbols even where they are zero.
    """
    if task.derivatives > 3:
        raise UnavailableError(
            "derivatives above the third are not computed by this version", where="derivatives"
        )
    mechanism, names = problem.mechanism, free_numbers().union(free)
    numbers = plan(mechanism, task)
    course = numbers.course and (numbers.course.turns, numbers.course.text)
    key = (
        structure_of(mechanism, names),
        tuple(c.text for c in numbers.coordinates),
        *(course, numbers.by_value, numbers.time_of() is not None),
        *(task.outputs, task.derivatives, task.measures, task.find, loaded, more, names),
    )
    shape = SHAPES.get(key)
    found = None
    if isinstance(shape, Shape):
        found = _again(shape, mechanism, numbers, task, loaded)
    if found is not None:
        return found
    model = model_of(mechanism, numbers.coordinates, names)
    kept = None if loaded is None else tuple(loaded(model))

    def build(coarse: bool) -> Setting:
        shape = _shape(model, numbers, task, more, kept, coarse)
        return shape.of(model, numbers, task.on_change_point)

    try:
        built = build(False)
        if built.scene.redundant:
            start.try_redundant(built.assembler, numbers)
    except FreedomError as error:  # of bodies that more equations hold together with others
        built = coarser(
            build, lambda setting: start.try_redundant(setting.assembler, numbers), error
        )
    SHAPES.put(key, built.shape)
    return built


def _shape(
    model: Model,
    numbers: DriverPlan,
    task: Sweep,
    more: Callable[[Scene], list[Request]] | None,
    loaded: tuple[str, ...] | None,
    coarse: bool,
) -> Shape:
    """Return scene, outputs and kernels of a model and a task."""
    sought, bodies = [find.output for find in task.find or ()], set[str]()
    if sought:
        from mechdae.describe.named import bodies_of

        bodies = bodies_of(model.mechanism, sought)
    the_scene = scene(model, numbers.coordinates, task.outputs, coarse, loaded, bodies)
    expressions, hidden, order = None, list[Request](), task.derivatives
    if the_scene.selection.named or sought:
        from mechdae.motion.setup.named_outputs import NamedOutputs, requests

        named, timed = the_scene.selection.named, numbers.time_of() is not None
        listed = {*sought, *(named if task.outputs is not None else ())}
        driven = [c.text for c in numbers.coordinates] if task.forces else None
        names = list(dict.fromkeys((*named, *sought)))
        expressions = NamedOutputs(model, names, task.derivatives, listed, timed, driven)
        hidden += requests(model, [*expressions.rates, *expressions.forced])
    if task.measures:
        from mechdae.motion.measures import measure

        hidden += measure.requests(the_scene, task, numbers.by_value)
        order = max(order, measure.order_of(task))
    hidden += more(the_scene) if more is not None else []
    outputs = Outputs(the_scene, hidden)
    graphs = Graphs(the_scene, outputs.expression, order, numbers.course)
    return Shape(the_scene, outputs, graphs, expressions, loaded, coarse)


def _again(
    shape: Shape,
    mechanism: Mechanism,
    numbers: DriverPlan,
    task: Sweep,
    loaded: Callable[[Model], Iterable[str]] | None,
) -> Setting | None:
    """Return the setting of a mechanism of a known shape, None where its values make another one.

    Which equations are redundant, and so what the groups are, is a matter of values.
    """
    model = shape.scene.model.at(mechanism)
    if loaded is not None and set(loaded(model)) != set(shape.loaded or ()):
        return None
    setting = shape.of(model, numbers, task.on_change_point)
    if not any(group.superfluous for group in shape.scene.all_groups):
        return setting
    known = shape.scene
    if shape.coarse or groups_of(model, known.rows, out=known.out) != known.all_groups:
        return None
    try:
        start.try_redundant(setting.assembler, numbers)
    except FreedomError:
        return None
    return setting


def first_pose(setting: Setting, task: Sweep) -> tuple[Unknowns, Unknowns]:
    """Return driver values and unknowns of the pose the path starts from."""
    setting.notes.clear()
    if task.mode is None:
        u, x = start.sketched_pose(setting.assembler, setting.plan)
        slips = partial(driver_slips, task, setting.scene.model.mechanism)
        assembler, searched = setting.assembler, setting.assembler.sketched
        first = (assembler, setting.plan, x, u, searched.ended, searched.turned, slips)
        setting.doubts = partial(start.doubts, *first)
        return u, x
    first = setting.plan.first
    u = np.where(np.isnan(first), start.start_values(setting.plan), first)
    return u, not_assembled.mode_by_label(setting.assembler, u, task.mode).x


def covered(
    follow: Callable[[Constants], tuple[P, Any]],
    setting: Setting,
    span: Floats,
    margin: Floats | float,
    start: tuple[Floats, Floats],
    graphs: Graphs | None = None,
) -> tuple[P, Any]:
    """Return what `follow` gives with bounds that hold for the path it found.

    The bounds of a sweep need the size of unknowns and drivers before they are known: they
    are assumed, and enlarged where the path went further. So is what curves divide by,
    which is measured, first at `start` (unknowns, driver values). `graphs` are those of the
    path where they are not the setting's.
    """
    graphs = graphs or setting.graphs
    size_u = np.max(np.abs(np.asarray(span, float)), axis=0) + margin
    size_x = None
    room = divisors(graphs, start[0][None, :], np.atleast_2d(start[1])) / 2
    for _ in range(GROWTHS):
        numbers = Constants(graphs, size_u, size_x, room)
        path, values = follow(numbers)
        found_x, found_u = path.sizes()
        found = divisors(graphs, *path.on_curves()[1:]) if graphs.contacts else room
        safe = not numbers.measured or np.all(numbers.floors[: len(found)] <= SAFE * found)
        if safe and np.all(found_x <= numbers.size_x) and np.all(found_u <= size_u):
            return path, values
        room = np.minimum(room, found)
        size_u = np.maximum(size_u, 1.5 * found_u)
        size_x = np.maximum(numbers.size_x, 1.5 * found_x)
    raise SolveError("an unknown grows without bound along the path")
