"""The brick: a facade of its link, motors, sensors, files and programs."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self, TypeVar, Unpack

from firmware_protocol.direct import GetBatteryLevel
from firmware_protocol.enums import InputPort, OutputPort
from firmware_protocol.errors import LinkError
from firmware_protocol.system import GetDeviceInfo, GetVersions, SetBrickName
from firmware_protocol.telegram import Reply
from nxtdrive.link.link import Link
from nxtdrive.link.threads import THREADS, Threads
from nxtdrive.link.timeouts import TIMEOUT_RANGE_S
from nxtdrive.ports import MotorPort, SensorPort, in_range, input_port, output_port
from nxtdrive.signals import termination_as_exit
from nxtdrive.transports import open_transport

if TYPE_CHECKING:
    from nxtdrive.motion.motor import Motor, MotorSettings
    from nxtdrive.motion.rover import Rover, RoverOptions
    from nxtdrive.onboard.display import Pixels
    from nxtdrive.onboard.files import Files
    from nxtdrive.onboard.programs import Programs
    from nxtdrive.onboard.speaker import Speaker
    from nxtdrive.sensors import ColorSensor, Compass, I2CSensor, Light, Sound, Temperature, Touch, Ultrasonic
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.base import Transport

R = TypeVar("R", bound=Reply)
P = TypeVar("P")

STOPPING_S = 0.15
"""How long motors brake before they are switched off when the program ends."""
LOW_BATTERY_MV = 7100
"""Voltage below which the brick itself warns if a rechargeable pack is in it. Source: docs/firmware.md section 8."""


@dataclass(frozen=True, slots=True)
class BrickInfo:
    """Identity and state of a brick.

    Attributes:
        name: As shown on its display.
        bluetooth_address: Six bytes in hex with colons; without them it is the id in ``usb://``.
        firmware: Such as ``1.29``.
        protocol: Such as ``1.124``.
        free_flash: Bytes free for files; the firmware updates it with a delay.
        battery_mv: Battery voltage, millivolts.
    """

    name: str
    bluetooth_address: str
    firmware: str
    protocol: str
    free_flash: int
    battery_mv: int


def open_brick(
    address: str | Address | None = None, *, timeout_s: float | None = None, reconnect: bool = False
) -> Brick:
    """Open a brick, check that it answers, and keep it awake.

    Args:
        address: ``usb://``, ``bt://00:16:53:0A:1B:2C``, ``serial://COM5``, ``tcp://host:port``, ``sim://``, ...
            None: ``$NXT``, and if that is not set the first brick on USB.
        timeout_s: Timeout of replies, here and in later requests, 0.001..3600. None: 1 s over USB, and 2 s where
            Bluetooth may be part of the link.
        reconnect: Whether a lost link is reopened automatically; see `Link.reconnecting`.

    Raises:
        AddressError: The address is not valid; the message lists valid ones.
        BrickNotFound: There is no brick at this address.
        LinkError: The brick is busy, not permitted or does not answer.
        LocalProtocolError: `timeout_s` is out of range.
    """
    if timeout_s is not None:
        in_range("timeout_s", timeout_s, *TIMEOUT_RANGE_S)
    transport = open_transport(address) if timeout_s is None else open_transport(address, timeout_s=timeout_s)
    brick = Brick(transport, timeout_s=timeout_s, reconnecting=reconnect)
    try:
        brick.link.keep_alive()
    except BaseException:
        brick.close()
        raise
    return brick


class Brick:
    """A brick behind an open transport. May be used from several threads.

    As a context manager it stops the motors and closes the link at the end of the block, even after an exception and on
    SIGTERM and SIGHUP, unless the program handles these.

    There is one object per port: a second call for a port returns the motor or sensor of the first, unless it is for
    another kind.

    Args:
        transport: An open transport.
        timeout_s: Default timeout of a reply.
        reconnecting: Whether a lost link is reopened automatically.
        threads: Starts the link's thread and waits for threads.

    Attributes:
        link: The link, for requests, timers and reconnection.
        request: Sends a command and returns its reply, see `Link.request`: ``brick.request(GetOutputState(0))``.
    """

    def __init__(
        self,
        transport: Transport,
        *,
        timeout_s: float | None = None,
        reconnecting: bool = False,
        threads: Threads = THREADS,
    ) -> None:
        self.link = Link(transport, timeout_s=timeout_s, reconnecting=reconnecting, threads=threads)
        self.request = self.link.request
        self._parts: dict[object, Any] = {}
        self._termination = contextlib.ExitStack()

    def now(self) -> float:
        """Return the time on the link's clock: seconds since an arbitrary start; simulated ones in the simulator."""
        return self.link.now()

    def sleep(self, duration_s: float) -> None:
        """Sleep on the link's clock while motions continue. See `Link.sleep`.

        Raises:
            LocalProtocolError: `duration_s` is not a number.
        """
        self.link.sleep(in_range("duration_s", duration_s, -math.inf, math.inf))

    def info(self) -> BrickInfo:
        """Read name, address, versions and state, in three requests."""
        device, versions = self.request(GetDeviceInfo()), self.request(GetVersions())
        address = ":".join(f"{byte:02X}" for byte in device.address[:6])
        return BrickInfo(
            name=device.name,
            bluetooth_address=address,
            firmware=versions.firmware,
            protocol=versions.protocol,
            free_flash=device.free_flash,
            battery_mv=self.request(GetBatteryLevel()).voltage_mv,
        )

    @property
    def name(self) -> str:
        """Name on the display, 1 to 15 characters; may be set."""
        return self.request(GetDeviceInfo()).name

    @name.setter
    def name(self, name: str) -> None:
        self.request(SetBrickName(name))

    @property
    def battery_v(self) -> float:
        """Battery voltage, volts."""
        return self.request(GetBatteryLevel()).voltage_mv / 1000

    @property
    def volume(self) -> int:
        """Volume, 0..4, until the brick is switched off; may be set. Needs firmware 1.28 or later."""
        return self.speaker.volume

    @volume.setter
    def volume(self, level: int) -> None:
        self.speaker.volume = level

    def tone(self, frequency_hz: int, duration_ms: int) -> None:
        """Play a tone, 220..14080 Hz, 10..65535 ms; returns while it sounds."""
        self.speaker.tone(frequency_hz, duration_ms)

    def screenshot(self) -> Pixels:
        """Read the display: (64, 100) booleans, row 0 on top, true where a pixel is black."""
        from nxtdrive.onboard.display import read_display

        return read_display(self.link)

    @cached_property
    def speaker(self) -> Speaker:
        """Sound files and tones."""
        from nxtdrive.onboard.speaker import Speaker

        return Speaker(self.link, self.files)

    @cached_property
    def files(self) -> Files:
        """The files on the brick."""
        from nxtdrive.onboard.files import Files

        return Files(self.link)

    @cached_property
    def programs(self) -> Programs:
        """The programs on the brick, and messages to the one that runs."""
        from nxtdrive.onboard.programs import Programs

        return Programs(self.link, self.files, self.stop_motors)

    def motor(self, port: MotorPort, *, reversed: bool = False, settings: MotorSettings | None = None) -> Motor:
        """Return the motor on port "A", "B" or "C"; `reversed` if it is mounted the other way round."""
        from nxtdrive.motion.motor import SETTINGS, Motor

        how = (reversed, settings or SETTINGS)
        return self._part(output_port(port), how, lambda: Motor(self.link, port, reversed=reversed, settings=how[1]))

    def touch(self, port: SensorPort) -> Touch:
        """Return the touch sensor on port 1..4."""
        from nxtdrive.sensors import Touch

        return self._sensor(Touch, port)

    def ultrasonic(self, port: SensorPort) -> Ultrasonic:
        """Return the ultrasonic sensor on port 1..4."""
        from nxtdrive.sensors import Ultrasonic

        return self._sensor(Ultrasonic, port)

    def light(self, port: SensorPort, *, lamp: bool = True) -> Light:
        """Return the light sensor on port 1..4, its lamp on or off."""
        from nxtdrive.sensors import Light

        sensor = self._sensor(Light, port)
        sensor.lamp = lamp
        return sensor

    def sound(self, port: SensorPort, *, dba: bool = False) -> Sound:
        """Return the sound sensor on port 1..4; `dba`: A-weighted."""
        from nxtdrive.sensors import Sound

        sensor = self._sensor(Sound, port)
        sensor.dba = dba
        return sensor

    def color(self, port: SensorPort) -> ColorSensor:
        """Return the colour sensor on port 1..4."""
        from nxtdrive.sensors import ColorSensor

        return self._sensor(ColorSensor, port)

    def temperature(self, port: SensorPort) -> Temperature:
        """Return LEGO's digital temperature sensor on port 1..4."""
        from nxtdrive.sensors import Temperature

        return self._sensor(Temperature, port)

    def compass(self, port: SensorPort) -> Compass:
        """Return HiTechnic's compass on port 1..4."""
        from nxtdrive.sensors import Compass

        return self._sensor(Compass, port)

    def i2c(self, port: SensorPort, address: int = 0x02) -> I2CSensor:
        """Return any digital sensor on port 1..4, accessed by its registers; `address` is its 8-bit write address."""
        from nxtdrive.sensors import I2CSensor

        return self._part(input_port(port), (I2CSensor, address), lambda: I2CSensor(self.link, port, address))

    def rover(
        self,
        left: MotorPort = "B",
        right: MotorPort = "C",
        *,
        ultrasonic: SensorPort | None = 4,
        touch: SensorPort | None = 1,
        compass: SensorPort | None = None,
        **options: Unpack[RoverOptions],
    ) -> Rover:
        """Return this brick as a vehicle; the arguments are those of `nxtdrive.motion.rover.Rover`.

        Each call makes another rover, whose pose begins at zero: keep the first one.
        """
        from nxtdrive.motion.rover import Rover

        return Rover(
            self.link,
            left,
            right,
            ultrasonic=None if ultrasonic is None else self.ultrasonic(ultrasonic),
            touch=None if touch is None else self.touch(touch),
            compass=None if compass is None else self.compass(compass),
            **options,
        )

    def stop_motors(self) -> None:
        """Brake all motors that were driven, then switch them off, so that none stays under power."""
        from nxtdrive.motion.outputs import braked, coasting

        link = self.link
        link.motions.end_all()
        ports = sorted(link.driven_ports)
        link.driven_ports.clear()
        for port in ports:
            link.cancel_timer(port.name)
        if ports:
            with contextlib.ExitStack() as stack:  # last in, first out; all of it, even if something fails
                for port in reversed(ports):
                    stack.callback(link.send, coasting(port))
                stack.callback(link.transport.sleep, STOPPING_S)
                for port in reversed(ports):
                    stack.callback(link.send, braked(port))

    def close(self) -> None:
        """Stop the motors and close the link; may be called again, and does not fail if the link is lost."""
        self.link.reconnecting = False
        try:
            with contextlib.suppress(LinkError):
                self.stop_motors()
        finally:
            self.link.close()

    def __enter__(self) -> Self:
        self._termination.enter_context(termination_as_exit())
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.close()
        finally:
            self._termination.close()

    def _sensor(self, kind: Callable[[Link, SensorPort], P], port: SensorPort) -> P:
        return self._part(input_port(port), kind, lambda: kind(self.link, port))

    def _part(self, port: InputPort | OutputPort, kind: object, make: Callable[[], P]) -> P:
        """Return the object for a port: that of the last call if it was of the same kind, else a new one."""
        key = (type(port), port)
        if key not in self._parts or self._parts[key][0] != kind:
            self._parts[key] = kind, make()
        part: P = self._parts[key][1]
        return part
