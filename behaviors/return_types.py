"""Check what the methods of profiles, policies and skills return, which other packages may have written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from behaviors.mission import MissionError

Result = TypeVar("Result")


class WrongReturn(MissionError):
    """A method returned something else than it should, or nothing; the message names it with its file and line."""

    def __str__(self) -> str:
        return f"{super().__str__()}. Correct it there."


def checked(method: Callable[..., object], kind: type[Result], *arguments: object) -> Result:
    """Call a method and return its result.

    Args:
        method: A bound method.
        kind: What it should return; a protocol must be one that can be checked.
        arguments: Its arguments.

    Raises:
        WrongReturn: It returned something else, or cannot be called with these arguments.
    """
    try:
        result = method(*arguments)
    except TypeError as error:
        if error.__traceback__ is None or error.__traceback__.tb_next:  # raised in the method
            raise
        what = {0: "no argument", 1: "its argument"}.get(len(arguments), "its arguments")
        raise WrongReturn(f"{place(method)} does not take {what}: {error}") from error
    if isinstance(result, kind):
        return result
    article = "an" if kind.__name__[0] in "AEIO" else "a"
    wrong = f"{place(method)} returned {type(result).__name__}, not {article} {kind.__name__}"
    if result is not None and getattr(kind, "_is_protocol", False):
        methods = [name for name in vars(kind) if not name.startswith("_")]
        wrong += f": it lacks {' and '.join(f'{name}()' for name in methods if not hasattr(result, name))}"
    raise WrongReturn(wrong)


def checked_list(method: Callable[..., object], kind: type[Result], *arguments: object) -> Sequence[Result]:
    """Call a method that returns a list, and return it; as for `checked`, but `kind` is that of its elements.

    Raises:
        WrongReturn: It returned something else, or an element is something else.
    """
    found: Sequence[Any] = checked(method, Sequence, *arguments)  # type: ignore[type-abstract]
    for each in found:
        if not isinstance(each, kind):
            raise WrongReturn(f"{place(method)} returned a list with {type(each).__name__}, not {kind.__name__}")
    return found


def place(method: Any) -> str:  # noqa: ANN401 - anything that can be called
    """Return a method in words: its name, class, file and line, as far as they are known."""
    function = getattr(method, "__func__", method)
    code = getattr(function, "__code__", None)
    where = f" ({code.co_filename}:{code.co_firstlineno})" if code else ""
    name = getattr(function, "__name__", type(method).__name__)
    if (owner := getattr(method, "__self__", None)) is None:
        return f"{name}() of {method.__module__}:{getattr(method, '__qualname__', name).rpartition('.')[0]}{where}"
    kind = owner if isinstance(owner, type) else type(owner)
    return f"{name}() of {kind.__module__}:{kind.__qualname__}{where}"
