"""The interfaces of a link for sensors, files, programs and motors; `nxtdrive.link.link.Link` has them all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from firmware_protocol.telegram import Command, Reply

if TYPE_CHECKING:
    from firmware_protocol.enums import OutputPort
    from nxtdrive.link.scheduler import MotionScheduler
    from nxtdrive.link.threads import Lock
    from nxtdrive.transports.base import Transport

R = TypeVar("R", bound=Reply)


class RequestLink(Protocol):
    """Requests, commands, locks and the link's clock.

    Attributes:
        transport: The transport in use; replaced on reconnection.
        max_telegram: Longest telegram the brick takes on this link, bytes.
    """

    transport: Transport
    max_telegram: int

    def request(self, command: Command[R], timeout_s: float | None = None) -> R:
        """Send a command and return its reply."""
        ...

    def send(self, command: Command[Any]) -> None:
        """Send a command without asking for a reply."""
        ...

    def now(self) -> float:
        """Return seconds since an arbitrary start; never goes back."""
        ...

    def sleep(self, duration_s: float) -> None:
        """Let time pass on the link's clock."""
        ...

    @property
    def latency_s(self) -> float:
        """Round-trip time of a request."""
        ...

    @property
    def surplus_telegrams(self) -> int:
        """Number of telegrams that arrived without belonging to a request."""
        ...

    def lock(self) -> Lock:
        """Make a lock that may be held during a request; not reentrant."""
        ...


class MotorLink(RequestLink, Protocol):
    """Requests, timed telegrams for leases and brakes, and motions in steps.

    Attributes:
        motions: Starts motions, and cancels those of motors that get other commands.
    """

    motions: MotionScheduler

    def mark_driven(self, port: OutputPort) -> None:
        """Record that a motor is under power."""
        ...

    def repeat(self, name: str, command: Command[Any], interval_s: float, until_s: float = ...) -> None:
        """Send `command` every `interval_s` until `until_s`."""
        ...

    def send_at(self, name: str, command: Command[Any], time_s: float) -> None:
        """Send `command` once at `time_s` on the link's clock."""
        ...

    def cancel_timer(self, name: str) -> None:
        """Cancel the timer that `repeat` or `send_at` started under `name`."""
        ...

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off."""
        ...
