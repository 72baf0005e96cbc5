"""A value that changes at planned times."""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

T = TypeVar("T")


class Settles(Protocol):
    """An object with planned changes."""

    def settle(self) -> None:
        """Make the changes whose time has come."""


class Settled(Generic[T]):
    """An attribute that is up to date whenever it is read; the object itself changes it as `_name`."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = f"_{name}"

    def __get__(self, instance: Settles, owner: type) -> T:
        instance.settle()
        value: T = getattr(instance, self._name)
        return value

    def __set__(self, instance: Settles, value: T) -> None:
        setattr(instance, self._name, value)
