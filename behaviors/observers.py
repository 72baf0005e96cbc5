"""Observers of a mission: one that fails is reported once and left out, and the mission continues."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from typing import ParamSpec

from behaviors.journal import Observer, Record

P = ParamSpec("P")
OnFailure = Callable[[str, str], None]

log = logging.getLogger(__name__)


def _warn(name: str, error: str) -> None:
    log.warning("%s failed and is left out: %s", name, error)


def error_text(error: BaseException) -> str:
    """Return the text of an error, the system's without its number, or the name of its type if it has none."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


class Observers:
    """Passes each record on to several observers.

    Args:
        observers: Named after their types or functions; `add` takes a name.
        on_failure: Called once for each observer that fails, with its name and its error in words; it must not raise.

    Attributes:
        failures: Names of the observers that failed, each with its error in words.
    """

    def __init__(self, observers: Iterable[Observer] = (), on_failure: OnFailure = _warn) -> None:
        self.failures: dict[str, str] = {}
        self._on_failure = on_failure
        self._observers: list[Callable[[Record], None]] = []
        for number, observer in enumerate(observers):
            self.add(f"{getattr(observer, '__qualname__', type(observer).__name__)} ({number})", observer)

    def __call__(self, record: Record) -> None:
        """Pass a record on."""
        for observer in self._observers:
            observer(record)

    def add(self, name: str, observer: Observer) -> None:
        """Pass records on to `observer` too."""
        self._observers.append(self.guarded(name, observer))

    def summary(self) -> dict[str, object]:
        """Return the failures as an entry of a summary, empty if there are none."""
        return {"observer_failures": dict(self.failures)} if self.failures else {}

    def guarded(self, name: str, observer: Callable[P, object]) -> Callable[P, None]:
        """Wrap `observer` so that it raises nothing and does nothing once something with its name has failed."""

        def call(*args: P.args, **kwargs: P.kwargs) -> None:
            if name not in self.failures:
                self.attempt(name, observer, *args, **kwargs)

        return call

    def attempt(self, name: str, step: Callable[P, object], *args: P.args, **kwargs: P.kwargs) -> None:
        """Call `step`, even if `name` has failed before, and record its failure under `name`."""
        try:
            step(*args, **kwargs)
        except Exception as error:  # noqa: BLE001 - no fault of an observer may end a mission
            if name not in self.failures:
                self.failures[name] = error_text(error)
                self._on_failure(name, self.failures[name])
