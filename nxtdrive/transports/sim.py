"""The simulator as a transport: `sleep` and `receive` *are* the simulation.

Simulated time stands still while the program computes, so a mission of minutes runs in seconds and is repeatable.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from firmware_protocol.errors import AddressError, LinkLost
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from nxtdrive.transports.address import Address
from nxtdrive.transports.base import Transport
from nxtdrive.transports.record import recorded
from nxtdrive.transports.sleep_warning import SleepWarning

if TYPE_CHECKING:
    from sim_backend.link import LinkFaults, SimLink
    from sim_backend.simulation import Simulation

USB_LATENCY_MS = 2.0
"""Round trip over USB as measured by the Player project (playerstage.sourceforge.net, driver nxt)."""
MAX_LATENCY_MS = 10_000
"""Longest round trip that can be set: on a slower link every request times out before its reply."""

LAG_S = 1.0
"""A real-time simulation that lags more than this, e.g. after waiting for the user, does not catch up."""

SHARED_MARK = "@"
_shared: dict[str, Callable[[], SimTransport]] = {}


@contextlib.contextmanager
def shared(name: str, opener: Callable[[], SimTransport]) -> Iterator[str]:
    """Make ``sim://@name`` open a running simulation within the block.

    Args:
        name: An unused name of letters and digits.
        opener: Makes another link to the simulation.

    Yields:
        The address.
    """
    if name in _shared:
        raise ValueError(f"sim://{SHARED_MARK}{name} is taken")
    _shared[name] = opener
    try:
        yield f"sim://{SHARED_MARK}{name}"
    finally:
        del _shared[name]


def _open_shared(address: Address) -> SimTransport:
    opener = _shared.get(address.target.removeprefix(SHARED_MARK))
    if opener is None:
        known = ", ".join(f"sim://{SHARED_MARK}{name}" for name in _shared) or "none"
        raise AddressError(f"no running simulation is called {address}; there is {known}.")
    address.read_options({})
    return opener()


class SimTransport:
    """``sim://`` for the bundled world, or ``sim://my-room.toml?seed=7&latency_ms=30&faults=faults.toml``.

    Further options are ``pace=realtime`` and ``firmware=1.05``.

    Args:
        simulation: Holds brick, world and clock.
        latency_ms: Round trip of the link; USB has 2, Bluetooth 30 to 65.
        realtime: Whether a simulated second takes at least a real one.
        faults: Faults to inject on the link.
        address: The address that opened it.
        warn_of_sleep: Whether to warn a program that waits with ``time.sleep``, during which no simulated time passes.

    Attributes:
        webcam: The camera on the robot; see `nxtdrive.vision.camera.FrameSource`.
        truth: Where everything really is; see `nxtdrive.mission.truth.Truth`.
    """

    max_telegram = USB_TELEGRAM_LIMIT
    simulated = True

    def __init__(
        self,
        simulation: Simulation,
        *,
        latency_ms: float = USB_LATENCY_MS,
        realtime: bool = False,
        faults: LinkFaults | None = None,
        address: str = "sim://",
        warn_of_sleep: bool = True,
    ) -> None:
        self.address = address
        self.webcam: Any = simulation.webcam
        self.truth: Any = simulation.truth
        self._simulation = simulation
        self._latency_ms = latency_ms
        self._faults = faults
        self._sleep_warning = None if realtime or not warn_of_sleep else SleepWarning()
        self._started_s = time.monotonic() - simulation.now_ms / 1000 if realtime else None
        self._link: SimLink = self._plug_in()

    @property
    def may_be_lost(self) -> bool:
        """Whether the link has faults; any other link to a simulated brick is never lost."""
        return self._faults is not None

    @property
    def simulation(self) -> Any:  # noqa: ANN401 - to evaluate or repeat a run; the driver does not read it
        """The simulation."""
        return self._simulation

    @classmethod
    def open(cls, address: Address, timeout_s: float = 1.0) -> SimTransport:  # noqa: ARG003 - opened like any other
        """Start a new simulation.

        Raises:
            AddressError: An option is unknown or its value invalid.
            ConfigError: There is no such world or file of faults, or it has errors.
        """
        if address.target.startswith(SHARED_MARK):
            return _open_shared(address)
        options = address.read_options(
            {"seed": _seed, "latency_ms": _latency, "pace": _pace, "firmware": _firmware, "faults": Path},
        )
        from sim_backend.faults_file import load_faults
        from sim_backend.simulation import DEFAULT_WORLD, Simulation

        simulation = Simulation(
            address.target or DEFAULT_WORLD,
            seed=options.get("seed", 0),
            firmware=options.get("firmware", "1.29"),
        )
        return cls(
            simulation,
            latency_ms=options.get("latency_ms", USB_LATENCY_MS),
            realtime=options.get("pace", False),
            faults=load_faults(options["faults"]) if "faults" in options else None,
            address=str(address),
        )

    def reopen(self, timeout_s: float = 1.0) -> Self:  # noqa: ARG002 - opened like any other
        """Return another link to the same simulated brick, after this one was lost."""
        return type(self)(
            self._simulation,
            latency_ms=self._latency_ms,
            realtime=self._started_s is not None,
            faults=self._faults,
            address=self.address,
            warn_of_sleep=self._sleep_warning is not None,
        )

    def send(self, telegram: bytes) -> None:
        """Send a telegram to the simulated brick."""
        if self._sleep_warning:
            self._sleep_warning.enter(self._simulation.motors_turn)
        try:
            self._link.send(telegram)
        except ConnectionError as error:
            raise self._lost(error) from error

    def receive(self, timeout_s: float) -> bytes | None:
        """Run the simulation until a reply arrives."""
        try:
            reply = self._link.receive(max(0, math.ceil(timeout_s * 1000)))
        except ConnectionError as error:
            raise self._lost(error) from error
        self._keep_pace()
        self._leave()
        return reply

    def waiting(self) -> bool:
        """Return whether a reply has arrived."""
        try:
            return self._link.arrived
        except ConnectionError as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Close the link."""
        self._link.close()

    @property
    def closed(self) -> bool:
        """Whether it was closed or lost."""
        return not self._link.is_open

    def now(self) -> float:
        """Return simulated seconds since the start."""
        return self._simulation.now_ms / 1000

    def sleep(self, duration_s: float) -> None:
        """Run the simulation for `duration_s`, in whole milliseconds and at least one."""
        if duration_s > 0:
            self._simulation.advance(max(1, round(duration_s * 1000)))
            self._keep_pace()
            self._leave()

    def on_frame(
        self, callback: Callable[[Any, float], None], fps: float, wanted: Callable[[], bool] = lambda: True
    ) -> None:
        """Call `callback` with the webcam's frame and its time, `fps` times per simulated second, if it is wanted."""
        self._simulation.on_frame(callback, fps, wanted)

    def _plug_in(self) -> SimLink:
        from sim_backend.link import NO_FAULTS, SimLink

        try:
            return SimLink(self._simulation, self._latency_ms, self._faults or NO_FAULTS)
        except ConnectionError as error:
            raise self._lost(error) from error

    def _leave(self) -> None:
        if self._sleep_warning:
            self._sleep_warning.leave()

    def _keep_pace(self) -> None:
        if self._started_s is None:
            return
        ahead_s = self._started_s + self.now() - time.monotonic()
        if ahead_s < -LAG_S:
            self._started_s -= ahead_s
        time.sleep(max(0.0, ahead_s))

    def _lost(self, error: ConnectionError) -> LinkLost:
        return LinkLost(f"{error}.", remedy="Open the brick again.")


def _seed(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError("it must be a whole number") from None


def _latency(text: str) -> float:
    with contextlib.suppress(ValueError):
        if 0 <= (value := float(text)) <= MAX_LATENCY_MS:
            return value
    raise ValueError(f"it must be a number from 0 to {MAX_LATENCY_MS}")


def _pace(text: str) -> bool:
    if text not in ("realtime", "fast"):
        raise ValueError("it must be 'realtime' or 'fast'")
    return text == "realtime"


def _firmware(text: str) -> str:
    from sim_backend.firmware.versions import FIRMWARES

    if text not in FIRMWARES:
        raise ValueError(f"it must be {' or '.join(FIRMWARES)}")
    return text


def simulated(transport: Transport) -> SimTransport | None:
    """Return a simulated brick's transport, also one that is recorded; None for any other."""
    inner = recorded(transport)
    return inner if isinstance(inner, SimTransport) else None
