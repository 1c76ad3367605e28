"""What parts, cases and other packages add by name: commands, tasks, pictures, formats, methods.

A room keeps its kinds in a `Registry`, which finds those of parts when they are asked for; so no
room names a part. A part is a package with a module ``adds``, whose ``ADDS`` is a dictionary
"commands", "tasks", ... -> name -> `Added`. Parts of this package stand in `mechdae.PARTS`; another
package adds its own by an entry point of the group ``mechdae.parts`` that leads to such a
dictionary::

    [project.entry-points."mechdae.parts"]
    my_part = "my_package.adds:ADDS"

A *case* is what only some mechanisms have: curves, redundant equations, space. It adds itself
in the same way, under the trait of those mechanisms, and the plain code asks all cases a question
(`of_cases`) without naming one. They stand in `mechdae.CASES`, in the order in which they answer.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from typing import Any, Generic, TypeVar

T = TypeVar("T")
GROUP = "mechdae.parts"
"""Of entry points of other packages."""


def lazy_names(homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package that imports its names when they are first used.

    Parameters
    ----------
    homes
        Module -> the names that are there, with blanks between them.
    """
    home = {name: module for module, names in homes.items() for name in names.split()}

    def found(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"no attribute '{name}'")
        return getattr(importlib.import_module(home[name]), name)

    return found


def at_home(home: str) -> Any:
    """Return what is at ``module`` or ``module:attribute``."""
    module, _, attribute = home.partition(":")
    loaded: Any = importlib.import_module(module)
    return getattr(loaded, attribute) if attribute else loaded


class Added:
    """Something a part adds under a name.

    Parameters
    ----------
    home
        Where it is, ``module`` or ``module:attribute``; it is imported when it is used.
    after
        Name behind which it is listed, "" at the end.
    about
        What it is for, in lists.
    """

    __slots__ = ("about", "after", "home")

    def __init__(self, home: str, after: str = "", about: str = "") -> None:
        self.home: str = home
        self.after: str = after
        self.about: str = about

    def load(self) -> Any:
        """Return what is added."""
        return at_home(self.home)


class TaskKind(Added):
    """A kind of task; `home` is its class, functions are named ``module:function``.

    Parameters
    ----------
    run
        Computes a `Result` of a problem, the name of the task and the task.
    show, trial
        Of problem, task and model, what the task will build, for `mechdae show`; of problem and
        task, what would stop it, for `mechdae check` (`run` itself may be that).
    text
        A pair of functions of a result and a width: table and facts; "": those of poses.
    spread
        Whether it consists of many computations, which take ``workers`` and ``progress``.
    design, log
        Looks for designs as a job: of problem, task and a `JobCall`; the name of its log.
    """

    __slots__ = ("design", "log", "run", "show", "spread", "text", "trial")

    def __init__(
        self,
        home: str,
        after: str = "",
        about: str = "",
        *,
        run: str = "",
        show: str = "",
        trial: str = "",
        text: str = "",
        spread: bool = False,
        design: str = "",
        log: str = "",
    ) -> None:
        super().__init__(home, after, about)
        self.run: str = run
        self.show: str = show
        self.trial: str = trial
        self.text: str = text
        self.spread: bool = spread
        self.design: str = design
        self.log: str = log


def added_of(home: str, places: Mapping[str, str]) -> dict[str, Added]:
    """Return what a package adds by name, of name -> ``module:attribute`` inside of it."""
    return {name: Added(f"{home}.{place}") for name, place in places.items()}


Adds = Mapping[str, Mapping[str, Added]]


@cache
def _of_parts() -> tuple[Adds, ...]:
    parts = importlib.import_module("mechdae").PARTS
    return tuple(importlib.import_module(f"{part}.adds").ADDS for part in parts)


@cache
def _cases() -> tuple[Adds, ...]:
    cases = importlib.import_module("mechdae").CASES
    return tuple(importlib.import_module(f"{case}.adds").ADDS for case in cases)


@cache
def _answers(question: str, traits: frozenset[str] | None) -> list[Any]:
    answers = (adds.get(question, {}) for adds in _cases())
    return [
        added.load()
        for each in answers
        for trait, added in each.items()
        if traits is None or trait in traits
    ]


def of_cases(question: str, traits: Collection[str] | None = None) -> list[Any]:
    """Return what cases add under a question, of those with one of some traits, without: of all."""
    if traits is not None and not traits:
        return []
    return _answers(question, None if traits is None else frozenset(traits))


@cache
def _of_others() -> tuple[Adds, ...]:
    from importlib.metadata import entry_points  # takes longer than a command may, see `Registry`

    return tuple(entry.load() for entry in entry_points(group=GROUP))


class Kinds(Mapping[str, T], Generic[T]):
    """Kinds of something by name; what is `Added` is imported when it is first asked for.

    Parameters
    ----------
    plain
        The kinds in the order of lists.
    made
        What becomes of an `Added`; without it what it leads to is loaded.
    """

    def __init__(
        self, plain: Mapping[str, T | Added], made: Callable[[Any], T] = Added.load
    ) -> None:
        self._plain, self._made = dict(plain), made

    def __getitem__(self, name: str) -> T:
        kind = self._plain[name]
        if isinstance(kind, Added):
            kind = self._plain[name] = self._made(kind)
        return kind

    def __contains__(self, name: object) -> bool:
        return name in self._plain

    def __iter__(self) -> Iterator[str]:
        return iter(self._plain)

    def __len__(self) -> int:
        return len(list(iter(self)))


class Registry(Kinds[T]):
    """The kinds of something by name: those of its room, and those that are added.

    What other packages add is looked for where a name is unknown, and where `whole` asks for it.

    Parameters
    ----------
    slot
        Its name in ``ADDS``.
    plain, made
        Of the room, as of `Kinds`.
    """

    def __init__(
        self, slot: str, plain: Mapping[str, T | Added], made: Callable[[Any], T] = Added.load
    ) -> None:
        super().__init__(plain, made)
        self.slot = slot
        self._others = False

    def added(self) -> dict[str, Added]:
        """Return what is added, by name."""
        parts = _of_parts() + (_of_others() if self._others else ())
        return {name: added for adds in parts for name, added in adds.get(self.slot, {}).items()}

    def whole(self) -> Registry[T]:
        """Return itself, with what other packages add."""
        self._others = True
        return self

    def __getitem__(self, name: str) -> T:
        if name in self._plain:
            return super().__getitem__(name)
        added = self.added().get(name) or self.whole().added()[name]
        return self._made(added)

    def __setitem__(self, name: str, value: T) -> None:
        self._plain[name] = value

    def __delitem__(self, name: str) -> None:
        del self._plain[name]

    def __contains__(self, name: object) -> bool:
        return name in self._plain or name in self.added() or name in self.whole().added()

    def __iter__(self) -> Iterator[str]:
        names = list(self._plain)
        waiting = {name: added for name, added in self.added().items() if name not in names}
        while waiting:  # each round lists one at least
            ready = [name for name, added in waiting.items() if added.after in names]
            for name in ready or list(waiting)[:1]:
                after = waiting.pop(name).after
                names.insert(names.index(after) + 1 if after in names else len(names), name)
        return iter(names)
