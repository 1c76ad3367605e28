"""Dataclasses whose methods are written when a class is first used.

`dataclass` does what that of the standard library does, with ``frozen``, ``eq``, ``repr`` and
``kw_only``, but compiles nothing on import: of the classes that a command imports most are never
made an instance of. ``fields``, ``replace`` and ``asdict`` work as they do there. Fields that are
checked when they are given are a `key`, or `optional`. A `public` function answers slips in
keywords with the nearest name, as records do.
"""

from __future__ import annotations

import dataclasses
import inspect
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial, wraps
from importlib import import_module
from operator import attrgetter
from reprlib import recursive_repr
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Generic,
    Protocol,
    TypeVar,
    cast,
    dataclass_transform,
    overload,
)

from mechdae.errors import UnknownArgument

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])
ANY_KEYWORD = 8
"""Flag of the code of functions that take any keyword."""


def key(kind: str, *, doc: str = "", choices: Sequence[str] = (), unit: str | None = None) -> Any:
    """Return a field that has to be given: a value of `kind` (a name in `describe.values.COERCE`).

    ``unit`` is that of its numbers ("1": a plain number), None where it depends on other keys.
    """
    return _field(kind, dataclasses.MISSING, doc, choices, unit)


def optional(
    kind: str, default: object = None, *, doc: str = "", choices: Sequence[str] = (),
    unit: str | None = None,
) -> Any:  # fmt: skip
    """Return a field as of `key` that has a value where none is given."""
    return _field(kind, default, doc, choices, unit)


def _field(
    kind: str, default: object, doc: str, choices: Sequence[str], unit: str | None
) -> object:
    metadata = {"kind": kind, "doc": doc, "choices": tuple(choices), "unit": unit,
                "required": default is dataclasses.MISSING}  # fmt: skip
    return dataclasses.field(default=default, metadata=metadata)


if TYPE_CHECKING:
    Given = TypeVar("Given", contravariant=True)
    Held = TypeVar("Held", covariant=True)

    class Takes(Protocol, Generic[Given, Held]):
        """Annotates a field that takes a `Given`, and holds what becomes of it."""

        def __get__(self, item: object, owner: Any = None) -> Held: ...
        def __set__(self, item: object, value: Given) -> None: ...


@overload
def dataclass(cls: type[T], /) -> type[T]: ...
@overload
def dataclass(
    *, frozen: bool = False, eq: bool = True, repr: bool = True, kw_only: bool = False
) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(field_specifiers=(key, dataclasses.field))
def dataclass(
    cls: Any = None, /, *, frozen: bool = False, eq: bool = True, repr: bool = True,
    kw_only: bool = False,
) -> Any:  # fmt: skip
    """Return the class as a dataclass."""

    def made(kind: Any) -> Any:
        text = kind.__doc__ = kind.__doc__ or kind.__name__  # else its signature is written there
        with _thawed(kind, frozen):
            dataclasses.dataclass(kind, init=False, repr=False, eq=False, kw_only=kw_only)
        given = kind.__dataclass_params__
        given.init, given.repr, given.eq, given.frozen = True, repr, eq, frozen
        _write(kind, frozen, eq, repr)
        kind.__doc__ = _Doc(text)
        return kind

    return made if cls is None else made(cls)


class Record:
    """Base of records of which Tab lists the fields, and what ``shows`` names: what users call.

    What rooms ask of a record stands in its class too, and is not listed.
    """

    shows: ClassVar[str] = ""
    constructed: ClassVar[bool] = True
    """Whether users make one: else its signature says nothing of its fields."""

    def __dir__(self) -> list[str]:
        entries = dataclasses.fields(self)  # type: ignore[arg-type]
        named = [
            name for base in type(self).__mro__ for name in vars(base).get("shows", "").split()
        ]
        special = [name for name in super().__dir__() if name.startswith("__")]
        return [*(entry.name for entry in entries), *named, *special]


class _Doc:
    """The docstring of a class, made when it is read."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __get__(self, item: object, owner: type) -> str:
        return str(import_module("mechdae.docstrings").docstring(owner, self.text))


@contextmanager
def _thawed(cls: Any, frozen: bool) -> Iterator[None]:
    """Let a frozen class have frozen bases while its fields are gathered, and no others."""
    bases = [
        base.__dataclass_params__
        for base in cls.__mro__[1:]
        if "__dataclass_params__" in vars(base)
    ]
    held = [base.frozen for base in bases]
    if bases and any(held) != frozen:
        words = ("non-frozen", "frozen") if any(held) else ("frozen", "non-frozen")
        raise TypeError(f"cannot inherit {words[0]} dataclass from a {words[1]} one")
    for base in bases:
        base.frozen = False
    try:
        yield
    finally:
        for base, flag in zip(bases, held, strict=True):
            base.frozen = flag


def _write(cls: Any, frozen: bool, eq: bool, shown: bool) -> None:
    """Give a class its methods; those that it has of its own stay."""
    given = vars(cls)
    entries = dataclasses.fields(cls)
    hashes = given.get("__hash__") is not None
    if "__init__" not in given:
        cls.__init__ = _first_init(cls, frozen)
        cls.__signature__ = _Signature()
    if shown and "__repr__" not in given:
        cls.__repr__ = _repr
    if eq and "__eq__" not in given:
        cls.__eq__ = _equality([e.name for e in entries if e.compare])
    if eq and not hashes:
        hashed = [e.name for e in entries if (e.compare if e.hash is None else e.hash)]
        cls.__hash__ = _hash(hashed) if frozen else None
    if frozen:
        _freeze(cls, frozenset(entry.name for entry in entries))


def _first_init(cls: Any, frozen: bool) -> Any:
    """Return a method that puts the one compiled for the class in its own place."""

    def first_init(self: object, *values: object, **named: object) -> None:
        compiled = _compiled_init(cls, frozen)
        cls.__init__ = compiled
        compiled(self, *values, **named)

    first_init.__qualname__ = f"{cls.__qualname__}.__init__"
    vars(first_init)["compiled"] = lambda: _compiled_init(cls, frozen)
    return first_init


def _compiled_init(cls: Any, frozen: bool) -> Any:
    known: dict[str, object] = {
        "_set": object.__setattr__, "_made": _MADE, "_refuse": _refuse
    }  # fmt: skip
    plain: list[str] = []
    named: list[str] = []
    body = []
    for entry in dataclasses.fields(cls):
        name = entry.name
        known[f"_default_{name}"], known[f"_factory_{name}"] = entry.default, entry.default_factory
        value, default = name, ""
        if entry.default_factory is not dataclasses.MISSING:
            default = " = _made"
            made = f"_factory_{name}()"
            value = f"{made} if {name} is _made else {name}" if entry.init else made
        elif entry.default is not dataclasses.MISSING:
            default = f" = _default_{name}"
        if entry.init:
            (named if entry.kw_only else plain).append(name + default)
        elif value == name:
            continue  # the class has its default
        body.append(f"_set(self, '{name}', {value})" if frozen else f"self.{name} = {value}")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    heads = ", ".join(["self", *plain, *(["*", *named] if named else [])])
    if issubclass(cls, Record):
        heads += ", **_more"
        body.insert(0, "if _more: _refuse(self, _more)")
    exec(f"def __init__({heads}):\n " + "\n ".join(body or ["pass"]), known)
    init: Any = known["__init__"]
    init.__qualname__, init.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    init.__annotations__ = {e.name: e.type for e in dataclasses.fields(cls) if e.init}
    init.__annotations__["return"] = None
    return init


def _refuse(record: Any, more: Mapping[str, object]) -> None:
    """Raise for keywords that a record has no fields of."""
    known = [entry.name for entry in dataclasses.fields(record) if entry.init]
    raise UnknownArgument(next(iter(more)), known, type(record).__name__)


class _Made:
    """Stands in a signature for a value that is made for each instance."""

    def __repr__(self) -> str:
        return "<factory>"


_MADE = _Made()


class _Signature:
    """What ``inspect.signature`` says of a class, also before its first instance."""

    def __get__(self, item: object, owner: type[Any]) -> inspect.Signature:
        if not getattr(owner, "constructed", True):
            return inspect.Signature()
        init = owner.__init__
        init = vars(init).get("compiled", lambda: init)()
        signature = inspect.signature(init)
        given = list(signature.parameters.values())[1:]
        return signature.replace(parameters=[one for one in given if one.name != "_more"])


def _getter(names: list[str]) -> Callable[[Any], Any]:
    """Return what reads the values of an item as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda item: tuple(getattr(item, name) for name in names)


def _equality(names: list[str]) -> Any:
    values = _getter(names)

    def equal(self: object, other: object) -> Any:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return values(self) == values(other)

    return equal


def _hash(names: list[str]) -> Any:
    values = _getter(names)

    def hashed(self: object) -> int:
        return hash(values(self))

    return hashed


@recursive_repr()
def _repr(self: Any) -> str:
    entries = [entry for entry in dataclasses.fields(self) if entry.repr]
    fields = ", ".join(f"{entry.name}={getattr(self, entry.name)!r}" for entry in entries)
    return f"{type(self).__qualname__}({fields})"


def _freeze(cls: Any, names: frozenset[str]) -> None:
    def put(self: Any, name: str, value: Any) -> None:
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def delete(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    cls.__setattr__ = put
    cls.__delattr__ = delete


# -- functions of users ------------------------------------------------------------------------


@overload
def public(function: F, /) -> F: ...
@overload
def public(*, old: str, several: bool = False) -> Callable[[F], F]: ...
def public(function: Any = None, /, *, old: str = "", several: bool = False) -> object:
    """Answer keywords that a function does not take with the nearest that it takes.

    Parameters
    ----------
    old
        The arguments in the order of earlier versions. It holds, with a warning, where there are
        more arguments without a keyword than the function takes so, or the second is no task.
    several
        Whether the second may be a list of tasks.
    """
    if function is None:
        return partial(public, old=old, several=several)
    code, called = function.__code__, function.__name__
    first, order = code.co_varnames[: code.co_argcount], old.split()
    known = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    any_keyword = bool(code.co_flags & ANY_KEYWORD)

    @wraps(function)
    def answering(*values: object, **named: object) -> object:
        tasks = values[1:2]
        if several and tasks and isinstance(tasks[0], list | tuple):
            tasks = tuple(tasks[0])
        if order and (len(values) > len(first) or not _is_task(tasks)):
            values, named = (), by_order(called, order, values, named)
        for word in named:
            if word not in known and not any_keyword:
                raise UnknownArgument(word, known, called)
        return function(*values, **named)

    return answering


def by_order(
    called: str, order: list[str], values: tuple[object, ...], named: dict[str, object]
) -> dict[str, object]:
    """Return arguments of an order of earlier versions as keywords, with a warning."""
    given = dict(zip(order, values, strict=False))
    new = ", ".join(f"{word}=..." for word in list(given)[1:])
    warnings.warn(
        f"{called}({', '.join(given)}) in this order is deprecated: {called}({order[0]}, {new})",
        DeprecationWarning,
        stacklevel=3,
    )
    if len(values) > len(order) or given.keys() & named.keys():
        raise TypeError(f"{called}() takes {', '.join(order)}, each once")
    return {**given, **named}


def _is_task(second: tuple[object, ...]) -> bool:
    """Return whether a second argument, if there is one, may be a task or its name."""
    return all(isinstance(value, str | None) or hasattr(value, "kind") for value in second)


def renamed(function: F, old: str, order: str) -> F:
    """Return a function under its name, and with the arguments, of earlier versions."""
    words = order.split()

    @wraps(function)
    def answering(*values: object, **named: object) -> object:
        return function(**dict(zip(words, values, strict=False)), **named)

    warnings.warn(f"{old} is called {function.__name__} now", DeprecationWarning, stacklevel=3)
    return cast("F", answering)
