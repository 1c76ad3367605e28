"""Every error mechdae raises on purpose.

MechdaeError
+-- InputError (ValueError)          what the user wrote
|   +-- ProblemFileError             a problem file: file and key path
|   +-- MechanismError               the mechanism itself: body, joint, load
|   |   +-- FreedomError             bodies move by themselves: dependent equations
|   +-- UnknownName                  a name that is not there, with the nearest ones
|   |   +-- UnknownArgument (TypeError)  a keyword that a function does not take
|   +-- UnavailableError             a valid request this version does not compute
+-- SolveError (RuntimeError)        the file is fine, the mechanism is not able to
    +-- AssemblyError                no pose: group, joint, gap
    +-- IndeterminateFrictionError   friction on a normal force that is not unique
    +-- InconsistentStartError       positions or speeds of a motion contradict the constraints
    +-- InfeasibleMotionError        laws of time that go on at a dead point
    +-- SingularMassError            a free coordinate without inertia

A message has three parts: what, where, and what to try. Poses that are not reached are no
error: the result has them with their status, and says what is wrong in ``fault``.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType

CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
"""Letters that terminals obey, line ends and tabs aside."""
STEPS = re.compile(r"[./]")
"""What is between the words of names and of paths."""


class MechdaeError(Exception):
    """Base of all errors: catch it for whatever the package raises on purpose.

    Attributes
    ----------
    what, where, hint : str
        What is wrong, its place (file, key, joint, value of a driver), and what to try.

    Examples
    --------
    >>> try:
    ...     md.load("pendlum")
    ... except md.MechdaeError as error:
    ...     print(error.what, "-", error.hint)
    unknown problem 'pendlum' - did you mean pendulum or double-pendulum?
    """

    def __init__(self, what: str, *, where: str = "", hint: str = "") -> None:
        self.what = what
        self.where: str = where
        self.hint = hint
        super().__init__(what)

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        advice = f"\n  try: {self.hint}" if self.hint else ""
        return CONTROL.sub("\ufffd", f"{place}{self.what}{advice}")

    def __reduce__(self) -> tuple[object, ...]:
        """Return what another process makes the same error from, whatever its class takes."""
        return _again, (type(self), dict(vars(self)), self.args)

    def inside(self, place: str) -> MechdaeError:
        """Return the same error with `place` put before its own place."""
        dot = "." if self.where and not self.where.startswith("[") else ""
        self.where = f"{place}{dot}{self.where}"
        return self


class within:  # noqa: N801  (used like a function)
    """Put a place before that of an error that is raised inside the block."""

    def __init__(self, place: str) -> None:
        self.place = place

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, MechdaeError):
            error.inside(self.place).__suppress_context__ = True


class InputError(MechdaeError, ValueError):
    """Something the user wrote is wrong.

    Examples
    --------
    >>> md.four_bar(0.1, 0.04, -0.12, 0.08)
    Traceback (most recent call last):
        ...
    mechdae.errors.InputError: four_bar: coupler: a length above 0 is needed, not -0.12
    """


class ProblemFileError(InputError):
    """A problem file cannot be read or does not follow the format.

    Examples
    --------
    >>> md.load("nothing.toml")
    Traceback (most recent call last):
        ...
    mechdae.errors.ProblemFileError: nothing.toml: there is no such file
    """


class MechanismError(InputError):
    """The bodies, joints and loads do not make a mechanism.

    Examples
    --------
    >>> md.Gear("mesh", "pinion.A", "wheel.B")
    Traceback (most recent call last):
        ...
    mechdae.errors.MechanismError: a gear needs either 'ratio' or 'teeth' with 'mesh'
    """


class SketchError(MechanismError):
    """The sketch does not tell which of several assembly modes is meant."""


class FreedomError(MechanismError):
    """Equations depend on each other and leave bodies of a group free."""


class UnknownName(InputError):
    """A name that does not exist, answered with the nearest ones, else with those ``listed``.

    Attributes
    ----------
    name : str
        The name that was given.

    Examples
    --------
    >>> md.load("pendlum")
    Traceback (most recent call last):
        ...
    mechdae.errors.UnknownName: predefined problems: unknown problem 'pendlum'
      try: did you mean pendulum or double-pendulum?
    """

    def __init__(
        self, kind: str, name: str, known: Iterable[str], *, where: str = "",
        listed: Collection[str] = (),
    ) -> None:  # fmt: skip
        near = nearest(name, known)
        self.name: str = str(name)
        hint = f"one of {', '.join(listed)}" if listed else ""
        hint = f"did you mean {' or '.join(near)}?" if near else hint
        super().__init__(f"unknown {kind} '{shorten(name)}'", where=where, hint=hint)


class UnknownArgument(UnknownName, TypeError):
    """A keyword that a function, or a value, does not take."""

    def __init__(self, name: str, known: Iterable[str], where: str) -> None:
        super().__init__("argument", name, known, where=where)


class UnavailableError(InputError):
    """The request is valid, but this version of mechdae does not compute it.

    Examples
    --------
    >>> try:
    ...     md.plot(md.four_bar(0.1, 0.04, 0.12, 0.08), "page")
    ... except md.UnavailableError as error:
    ...     print(error.hint)
    md.page, or mechdae page
    """


class SolveError(MechdaeError, RuntimeError):
    """The description is fine, the computation cannot go on.

    Examples
    --------
    >>> try:
    ...     md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), set={"coupler": 0.5})
    ... except md.SolveError as error:
    ...     print(type(error).__name__)
    AssemblyError
    """


class AssemblyError(SolveError):
    """An Assur group cannot be assembled at the given pose of the driver.

    Examples
    --------
    >>> try:
    ...     md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), set={"coupler": 0.5})
    ... except md.AssemblyError as error:
    ...     print(error.hint)
    here coupler at most 0.167178 m, or rocker at least 0.412822 m
    """


class IndeterminateFrictionError(SolveError):
    """Friction acts on a normal force that redundant constraints leave open."""


class InconsistentStartError(SolveError):
    """What a motion starts from contradicts the constraints.

    Attributes
    ----------
    residuals : dict of str to float
        What is left of each constraint, by its name [m, rad, or a second of these].
    """

    residuals: Mapping[str, float] = MappingProxyType({})


class InfeasibleMotionError(SolveError):
    """Laws of time prescribe speeds that no motion has at a dead point.

    Attributes
    ----------
    residuals : dict of str to float
        What is left of each equation, by its name.
    time : float
        When [s].
    """

    residuals: Mapping[str, float] = MappingProxyType({})
    time: float = 0.0


class SingularMassError(SolveError):
    """A coordinate that no constraint holds has no inertia: its motion is not determined."""


def _again(
    kind: type[MechdaeError], attributes: Mapping[str, object], args: tuple[object, ...]
) -> MechdaeError:
    error = kind.__new__(kind)
    error.args = args
    vars(error).update(attributes)
    return error


def nearest(name: str, known: Iterable[str], count: int = 3) -> list[str]:
    """Return up to `count` known names that look like `name`, best first.

    The last word of a name with a dot stands for it: ``P`` is near ``coupler.P``, and ``B.angle``
    is near the path ``joints/B/angle``.
    """
    names = sorted(set(known))
    short = str(name)[:100]
    last = [entry for entry in names if entry.rpartition(".")[2].lower() == short.lower()]
    close = close_matches(short, names, count)
    part = [entry for entry in names if len(short) > 2 and short.lower() in entry.lower()]
    words = STEPS.split(short.lower())
    steps = [e for e in names if len(words) > 1 and _in_order(words, STEPS.split(e.lower()))]
    found = list(dict.fromkeys([*last, *sorted(steps, key=len), *close, *part]))[:count]
    return found or (names if len(names) <= 6 else [])


def _in_order(words: Iterable[str], steps: Iterable[str]) -> bool:
    """Return whether words are among the steps of a path, one after the other."""
    left = iter(steps)
    return all(word in left for word in words)


def close_matches(word: str, known: Iterable[str], count: int, cutoff: float = 0.6) -> list[str]:
    """Return up to `count` known words that share letters with `word`, best first."""
    from difflib import get_close_matches  # only where something is wrong

    return get_close_matches(word, list(known), n=count, cutoff=cutoff)


def shorten(text: str, width: int = 60) -> str:
    """Return `text` on one line, cut to `width` characters."""
    flat = " ".join(str(text).split())
    return flat if len(flat) <= width else flat[: width - 1] + "…"
