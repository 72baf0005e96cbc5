"""Load the class of a profile that is not built in, and say what is wrong with it before a robot moves."""

from __future__ import annotations

import inspect
import sys
from importlib import import_module
from pathlib import Path, PureWindowsPath
from traceback import walk_tb
from typing import Any

from behaviors.mission import MissionError
from behaviors.profile_names import installed_profiles, named_profiles
from behaviors.return_types import place
from input_files.mistakes import nearest

INTERFACE = "`python -m pydoc behaviors.profiles.profile` shows the interface."
CALLS = {
    "own_policy": ("mission",),
    "skill": ("self", "state", "choice"),
    "learn": ("self", "failure"),
    "evidence": ("self", "basis"),
    "select": ("self", "evidence"),
}
"""What a profile has, with the arguments on the class; `own_policy` is a class method."""


def load(name: str) -> Any:  # noqa: ANN401 - the class has been checked, not derived from ours
    """Return the class of an installed profile or of ``package.module:Class``.

    Raises:
        MissionError: It cannot be loaded, or is not a profile.
    """
    entry = installed_profiles().get(name)
    if entry and ":" not in entry.value:
        what = f"its entry point is {entry.value!r}, not module:Class; correct it in its package."
        raise MissionError(f"profile {name!r} cannot be loaded: {what}")
    try:
        found: Any = entry.load() if entry else _imported(name)
    except (Exception, SystemExit) as error:  # the module of another package may raise anything
        if is_signal(error):
            raise
        what = f"{_raised_at(error)}{described(error)}"
        raise MissionError(f"profile {name!r} cannot be loaded: {what}; {_remedy(name, error)}") from error
    _check(name, found)
    return found


def is_signal(error: BaseException) -> bool:
    """Return whether an error is that of a signal, which may come in any code: it is derived from SystemExit."""
    return isinstance(error, SystemExit) and type(error) is not SystemExit


def described(error: BaseException) -> str:
    """Return the type of an error and its text, if it has one, without a full stop."""
    text = str(error.msg if isinstance(error, SyntaxError) else error).rstrip(".")
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _imported(name: str) -> object:
    """Import a class from a module, even one in the current folder, as ``python -m`` does."""
    module, _, attribute = name.partition(":")
    if not attribute:
        raise ModuleNotFoundError(f"no installed package offers {name!r}")
    if _is_path(module):
        raise ModuleNotFoundError(f"{module!r} is a path, not the name of a module")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    return getattr(import_module(module), attribute)


def _is_path(module: str) -> bool:
    return module.startswith(".") or "/" in module or "\\" in module


def _raised_at(error: BaseException) -> str:
    """Return the place in the profile's code where its import failed; empty if it did not begin."""
    if isinstance(error, SyntaxError):
        return f"{error.filename}:{error.lineno}: "
    frames = [(frame.f_code.co_filename, line) for frame, line in walk_tb(error.__traceback__)]
    known = [(file, line) for file, line in frames if file != __file__ and "importlib" not in file]
    return "{}:{}: ".format(*known[-1]) if known else ""


def _remedy(name: str, error: BaseException) -> str:
    module, _, attribute = name.partition(":")
    if _is_path(module):
        stem = PureWindowsPath(module.removesuffix(".py")).name  # it takes both kinds of slashes
        return f"name it as {stem}:{attribute or 'CLASS'} in the folder of {stem}.py."
    if module.endswith(".py"):
        return f"leave out `.py`: {Path(module).stem}:{attribute}."
    if isinstance(error, ModuleNotFoundError) and error.name and not f"{module}.".startswith(f"{error.name}."):
        return f"install the package of {error.name}, or correct the import."
    if _raised_at(error):
        return "correct that line."
    if isinstance(error, AttributeError):
        file = getattr(error.obj, "__file__", None) or module
        return f"correct the name of the class, or write it in {file}."
    if not attribute and (near := nearest(name, named_profiles())):
        return f"did you mean {near!r}?"
    return "name it as module:Class in the folder of module.py, or install its package."


def _check(name: str, found: Any) -> None:  # noqa: ANN401 - it may be anything
    """Check that a class has the methods of a profile, and that they take the arguments.

    Raises:
        MissionError: It lacks one, or one takes other arguments.
    """
    missing = [each for each in CALLS if not callable(getattr(found, each, None))]
    if missing:
        raise MissionError(f"profile {name!r} lacks {', '.join(missing)}; {INTERFACE}")
    _check_call(name, found, found.__init__, f"{found.__name__}(context, mission, queue, policy=None)", 3, policy=None)
    for method, takes in CALLS.items():
        words = f"{method}({', '.join(each for each in takes if each != 'self')})"
        kind = ", a class method" if "self" not in takes else ""
        _check_call(name, getattr(found, method), getattr(found, method), words + kind, len(takes))


def _check_call(name: str, called: Any, method: Any, words: str, number: int, **named: object) -> None:  # noqa: ANN401
    try:
        signature = inspect.signature(called)
    except (TypeError, ValueError):  # not every callable object has one
        return
    try:
        signature.bind(*[None] * number, **named)
    except TypeError as error:
        text = f"profile {name!r} cannot be used: {place(method)} does not take the arguments of {words}: {error}"
        raise MissionError(f"{text}; {INTERFACE}") from None
