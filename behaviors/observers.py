"""Observers of a mission: one that fails is reported once and left out, and the mission goes on."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from typing import ParamSpec

from behaviors.journal import Observer, Record

P = ParamSpec("P")
OnFailure = Callable[[str, Exception], None]

log = logging.getLogger(__name__)


def _warn(name: str, error: Exception) -> None:
    log.warning("%s failed and is left out: %s", name, error)


class Observers:
    """Passes each record on to several observers.

    Args:
        observers: Without names of their own they are called after their types or functions.
        on_failure: Told once of each observer that fails: its name and the error. It must not raise.

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
        """Pass records on to `observer`, too."""
        self._observers.append(self.guarded(name, observer))

    def summary(self) -> dict[str, object]:
        """The failures as an entry of a summary; nothing without any."""
        return {"observer_failures": dict(self.failures)} if self.failures else {}

    def guarded(self, name: str, observer: Callable[P, object]) -> Callable[P, None]:
        """Make `observer` safe to call: it raises nothing, and does nothing once something of its name has failed."""

        def call(*args: P.args, **kwargs: P.kwargs) -> None:
            if name not in self.failures:
                self.attempt(name, observer, *args, **kwargs)

        return call

    def attempt(self, name: str, step: Callable[P, object], *args: P.args, **kwargs: P.kwargs) -> None:
        """Call `step` whatever has failed before; its failure counts as that of the observer `name`."""
        try:
            step(*args, **kwargs)
        except Exception as error:  # noqa: BLE001 - whatever is wrong with an observer, the robot goes on
            if name not in self.failures:
                self.failures[name] = str(error) or type(error).__name__
                self._on_failure(name, error)
