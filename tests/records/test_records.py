"""Dataclasses of the package do what those of the standard library do."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from dataclasses import field
from functools import cached_property, partial

import pytest

from mechdae import records


def classes(make):
    """Return the same classes as dataclasses of a library."""

    @make(frozen=True)
    class Point:
        x: float
        y: float = 2.0
        names: list = field(default_factory=list, compare=False)

        @cached_property
        def sum(self):
            return self.x + self.y

    @make(frozen=True)
    class Named(Point):
        name: str = "P"
        hidden: int = field(default=3, repr=False)
        made: tuple = field(init=False, default=(1,))

        def __post_init__(self):
            object.__setattr__(self, "name", self.name.upper())

    @make
    class Open:
        values: dict = field(default_factory=dict)
        own: object = None

    @make(frozen=True, kw_only=True, eq=False)
    class Words:
        first: int
        second: int = 5

    @make(frozen=True, repr=False)
    class One:
        value: int

        def __hash__(self):
            return 17

    @make(frozen=True)
    class Empty:
        pass

    return Point, Named, Open, Words, One, Empty


OURS, THEIRS = classes(records.dataclass), classes(dataclasses.dataclass)
PAIRS = list(zip(OURS, THEIRS, strict=True))
ARGUMENTS = [
    ((1.0,), {}), ((1.0, 3.0), {"names": [1]}), ((1.0, 2.0, [], "q", 4), {}), ((), {}),
    ((), {"first": 1}), ((), {"first": 1, "second": 2}), ((1,), {"z": 3}), ((3,), {"value": 4}),
    (({"a": 1}, 5), {}), ((1, 2, 3, 4, 5, 6, 7), {}),
]  # fmt: skip


def outcome(way):
    try:
        return way()
    except Exception as error:
        return type(error).__name__, str(error)


def text(item):
    """Return what an instance shows, without the address that one without a text has."""
    return repr(item).split(" at 0x")[0].rpartition(".")[2]


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair[0].__name__)
def test_instances_are_those_of_the_standard_library(pair) -> None:
    made = []
    for values, named in ARGUMENTS:
        ours, theirs = (outcome(partial(c, *values, **named)) for c in pair)
        assert isinstance(ours, tuple) == isinstance(theirs, tuple)
        if isinstance(ours, tuple):
            assert ours == theirs
            continue
        made.append((ours, theirs))
        assert vars(ours) == vars(theirs)
        assert text(ours) == text(theirs)
        assert dataclasses.asdict(ours) == dataclasses.asdict(theirs)
        assert vars(dataclasses.replace(ours)) == vars(dataclasses.replace(theirs))
        hashes = [outcome(lambda i=i: isinstance(hash(i), int)) for i in (ours, theirs)]
        assert hashes[0] == hashes[1]
        if hashes[1] is True and type(theirs).__eq__ is not object.__eq__:
            assert hash(ours) == hash(theirs)
        for change in (lambda i: setattr(i, "x", 3), lambda i: delattr(i, "value")):
            assert outcome(lambda i=ours, c=change: c(i)) == outcome(
                lambda i=theirs, c=change: c(i)
            )
    assert made
    for first, one in made:
        for second, two in made:
            assert (first == second) == (one == two)


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair[0].__name__)
def test_classes_are_those_of_the_standard_library(pair) -> None:
    ours, theirs = pair
    assert str(inspect.signature(ours)) == str(inspect.signature(theirs))
    assert [f.name for f in dataclasses.fields(ours)] == [
        f.name for f in dataclasses.fields(theirs)
    ]
    assert dataclasses.is_dataclass(ours)
    assert ours.__match_args__ == theirs.__match_args__
    assert ours.__init__.__annotations__ == theirs.__init__.__annotations__


def test_a_signature_is_known_before_the_first_instance_and_that_of_an_own_init() -> None:
    first, *_ = classes(records.dataclass)

    class Sub(first):
        def __init__(self, z: int) -> None:
            super().__init__(z)

    assert list(inspect.signature(first).parameters) == ["x", "y", "names"]
    assert list(inspect.signature(Sub).parameters) == ["z"]
    assert Sub(4).x == 4


def test_a_repr_that_holds_itself_ends() -> None:
    item = OURS[2]()
    item.own = item
    assert repr(item).endswith("own=...)")


@records.dataclass(frozen=True)
class StructureCache:
    value: int
    more: tuple[int, ...] = ()

    @cached_property
    def double(self) -> int:
        return 2 * self.value


def test_copies_and_pickles() -> None:
    item = StructureCache(3, (1,))
    assert item.double == 6
    for other in (copy.copy(item), copy.deepcopy(item), pickle.loads(pickle.dumps(item))):
        assert other == item
        assert hash(other) == hash(item)
        assert other.double == 6
    with pytest.raises(dataclasses.FrozenInstanceError):
        item.value = 4


def test_classes_inherit_from_those_of_the_standard_library_and_these_from_them() -> None:
    for first, second in ((records, dataclasses), (dataclasses, records)):

        @first.dataclass(frozen=True)
        class Base:
            x: int

        @second.dataclass(frozen=True)
        class Sub(Base):
            y: int = 4

        assert (Sub(3).x, Sub(3).y, Sub(3) == Sub(3, 4)) == (3, 4, True)
        assert (Base.__dataclass_params__.frozen, Sub.__dataclass_params__.frozen) == (True, True)
        with pytest.raises(dataclasses.FrozenInstanceError):
            Sub(3).x = 4
        with pytest.raises(TypeError, match="non-frozen dataclass from a frozen"):
            second.dataclass(type("Open", (Base,), {}))

    @records.dataclass
    class Plain:
        x: int

    with pytest.raises(TypeError, match="frozen dataclass from a non-frozen"):
        records.dataclass(frozen=True)(type("Closed", (Plain,), {}))


def test_nothing_is_compiled_before_it_is_used() -> None:
    point, *_ = classes(records.dataclass)
    stub = point.__init__
    assert stub.__code__.co_flags & inspect.CO_VARKEYWORDS
    point(1.0)
    assert point.__init__ is not stub
