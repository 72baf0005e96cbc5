"""Test bench for a simulated brick: three motors, four adjustable inputs and I2C devices, driven by control lines.

The control lines are those of the recorded conversations, docs/firmware.md section 0.1.
"""

from __future__ import annotations

from collections.abc import Callable
from traceback import extract_tb

from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from firmware_protocol.iomap import UiFlag
from sim_backend.devices import AnalogInput, GenericI2CDevice
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.firmware.radio_stream import RadioStream
from sim_backend.firmware.sensors.analog import FULL_SCALE

_POLL_LIMIT = 100_000
"""Result of a wait that gives up; it has made one poll fewer."""
_MODE_MS = 5
"""Passes that a change of the radio's mode takes."""

_USB_MS = 1
"""Passes that the cable takes."""

_REPLY_TIMEOUT_MS = 5000
"""Passes that the recordings wait for a reply over Bluetooth."""
_WRITE_FORM = 0xFE
"""Mask of an I2C address without the bit that says that a device sends."""
MAX_COUNT = 1_000_000
"""Maximum number of passes, bytes or files of a control line: some seconds of work."""


class NotSupportedOnBench(Exception):
    """A control line needs something that the simulated brick or the bench does not have."""


class _BenchDevice(GenericI2CDevice):
    """A device that sends each register as it is when its byte begins."""

    def read(self, size: int) -> bytes:
        return super().read(min(size, 1))


class Bench:
    """A brick with motors and sensors attached, driven by control lines.

    Attributes:
        brick: The brick under test.
        motors: Motors on ports A, B, C.
        readings: Readings of the analog inputs 1 to 4.
    """

    def __init__(self, brick: SimBrick) -> None:
        self._set_up(brick)
        self._lines: dict[str, Callable[..., str]] = {
            "!tick": self._tick,
            "!sensor": self._sensor,
            "!battery": self._battery,
            "!motor": self._motor,
            "!turn": self._turn,
            "!motors": self._motors,
            "!trace": self._trace,
            "!also": self._also,
            "!until": self._until,
            "!until_uiidle": self._until_idle,
            "!until_run": self._until_run,
            "!i2c": self._i2c,
            "!sound": self._sound,
            "!power": self._power,
            "!btname": self._bluetooth_name,
            "!hs": self._high_speed,
            "!button": self._button,
            "!usb": self._usb,
            "!fill": self._fill,
            "!mkfiles": self._make_files,
            "!reboot": self._reboot,
            "!btmode": self._radio_mode,
            "!bt": self._bluetooth,
        }

    def _set_up(self, brick: SimBrick) -> None:
        """Attach new motors and sensors to a brick that was just switched on."""
        self.brick = brick
        self.motors = [BenchMotor() for _ in "ABC"]
        self.readings = [FULL_SCALE] * 4
        self._devices = [_BenchDevice() for _ in self.readings]
        self._attached, self._clocks = [False] * 4, [0] * 4
        self._radio, self._hidden_ms = RadioStream(brick), 0
        self._plugged, self._held, self._late = True, list[bytes](), list[bytes]()
        self._plug_in_motors()
        for index, channel in enumerate(brick.low_speed.channels):
            channel.bus.sensor.trace = []
            brick.attach_sensor(index + 1, self._analog(index))
            self._connect(index)

    def answer(self, line: str) -> str:
        """Answer a line of a conversation: a control line, or a request as hexadecimal digits."""
        return self.control(line) if line.startswith("!") else self.telegram(line)

    def telegram(self, request: str) -> str:
        """Send one telegram in hex and run one pass. More than 64 bytes make several packets.

        Without a cable nothing arrives; the last packet does when it is plugged in again.
        """
        data = bytes.fromhex(request)
        replies, self._late = self._late, []
        for start in range(0, len(data), USB_TELEGRAM_LIMIT):
            self._radio.follow()
            if self._radio.waiting or self._radio.sending:
                self._radio.take()
            packet = data[start : start + USB_TELEGRAM_LIMIT]
            if self._plugged:
                replies.append(self.brick.receive(packet) or b"")
            else:
                self._held = [packet]
            self._radio.note_command()
            self.brick.tick()
        return b"".join(replies).hex()

    def control(self, line: str) -> str:
        """Execute a control line; an exception of the simulated brick passes.

        Raises:
            NotSupportedOnBench: The line is unknown, or its arguments are wrong.
        """
        word, *arguments = line.split()
        action = self._lines.get(word)
        if action is None:
            raise NotSupportedOnBench(f"the control line {line!r} is not known; known are {', '.join(self._lines)}")
        try:
            return action(*arguments)
        except (ValueError, TypeError, IndexError, ZeroDivisionError) as error:
            if _raised_elsewhere(error):
                raise
            raise NotSupportedOnBench(f"the control line {line!r} cannot be carried out: {error}") from error

    def _tick(self, passes: str) -> str:
        end_ms = self.brick.now_ms + _count(passes)
        while self._radio.waiting and self.brick.now_ms < end_ms:
            self._radio.read_on()
            self.brick.tick()
        self.brick.tick(max(end_ms - self.brick.now_ms, 0))
        return f"ok t={self.brick.now_ms - self._hidden_ms}"

    def _sensor(self, port: str, raw: str) -> str:
        self.readings[int(port)] = int(raw)
        self.brick.input.wake()
        return "ok"

    def _battery(self, raw: str) -> str:
        self.brick.set_battery(int(raw, 0))
        return "ok"

    def _motor(self, port: str, *properties: str) -> str:
        gain, tau, tau_brake, tau_coast, deadband, locked = (int(value) for value in properties)
        self.motors[int(port)].configure(gain, tau, tau_brake, tau_coast, deadband, bool(locked))
        return "ok"

    def _turn(self, port: str, degrees: str) -> str:
        self.motors[int(port)].turn(int(degrees))
        self.brick.output.wake()
        return "ok"

    def _drive(self) -> list[tuple[int, int]]:
        return [(control.actual_speed, int(control.brake)) for control in self.brick.output.controls]

    def _motors(self) -> str:
        rows = zip(self._drive(), self.motors, strict=True)
        return " ".join(f"{pwm}/{brake}/{motor.count}" for (pwm, brake), motor in rows)

    def _trace(self, passes: str, interval: str) -> str:
        entries = []
        drive = self._drive()
        for number in range(1, _count(passes) + 1):
            counts = [motor.count for motor in self.motors]
            self.brick.tick()
            before, drive = drive, self._drive()
            if drive != before or number % int(interval) == 0:
                fields = [f"{pwm},{brake},{count}" for (pwm, brake), count in zip(drive, counts, strict=True)]
                entries.append(",".join([str(number), *fields]))
        return ";".join(entries)

    def _also(self, *requests: str) -> str:
        return " ".join(self.telegram(request) for request in requests)

    def _poll(self, request: str, byte: int, value: int) -> tuple[int, str]:
        """Repeat the request every pass until `byte` of the reply is `value`, or give up."""
        reply = ""
        for polls in range(1, _POLL_LIMIT):
            reply = self.telegram(request)
            if bytes.fromhex(reply)[byte : byte + 1] == bytes((value,)):
                return polls, reply
        return _POLL_LIMIT, reply

    def _until(self, request: str, status: str) -> str:
        return str(self._poll(request, 2, int(status, 16))[0])

    def _until_idle(self) -> str:
        for passes in range(1, _POLL_LIMIT):
            self.brick.tick()
            if not self.brick.ui.registers.flags & UiFlag.BUSY:
                return str(passes)
        return str(_POLL_LIMIT)

    def _until_run(self, port: str, run_state: str) -> str:
        polls, reply = self._poll(f"0006{int(port):02x}", 8, int(run_state, 16))
        return f"{polls} ms, {reply}"

    def _i2c(self, port: str, action: str, *arguments: str) -> str:
        index = int(port)
        device, sensor = self._devices[index], self.brick.low_speed.channels[index].bus.sensor
        match action:
            case "attach":
                device.address = int(arguments[0], 16) & _WRITE_FORM
                self._attached[index] = sensor.acknowledges = True
            case "detach":
                self._attached[index] = False
            case "set":
                start, data = int(arguments[0], 16), bytes.fromhex(arguments[1])
                for at, byte in enumerate(data, start):
                    device.registers[at % len(device.registers)] = byte
            case "stucksda":
                self.brick.low_speed.channels[index].bus.hold(data=arguments[0] == "1")
            case "stuckscl":
                self.brick.low_speed.channels[index].bus.hold(clock=arguments[0] == "1")
            case "ack":
                sensor.acknowledges = arguments[0] == "1"
            case "wack":
                sensor.acknowledges_data = arguments[0] == "1"
            case "log":
                return self._bus_log(index)
            case _:
                raise NotSupportedOnBench(f"!i2c {action} is not supported")
        self._connect(index)
        return "ok"

    def _bus_log(self, index: int) -> str:
        bus = self.brick.low_speed.channels[index].bus.sensor
        tokens, bus.trace = bus.trace or [], []
        clocks, self._clocks[index] = bus.clocks - self._clocks[index], bus.clocks
        return f"{' '.join(tokens)}  clocks={clocks}"

    def _analog(self, index: int) -> AnalogInput:
        return AnalogInput(lambda: self.readings[index])

    def _connect(self, index: int) -> None:
        """Connect the I2C device of a port if it is attached; the analog input has a pin of its own and stays."""
        bus = self.brick.low_speed.channels[index].bus
        bus.connect(self._devices[index] if self._attached[index] else None)

    def _sound(self) -> str:
        sound = self.brick.sound
        playing = "playing" if sound.audible else "done"
        if sound.from_file or sound.tone is None:
            return f"{'file' if sound.from_file else 'stopped'} {playing}"
        return f"tone hz={sound.tone.frequency_hz} ms={sound.tone.duration_ms} vol={sound.tone.volume} {playing}"

    def _power(self) -> str:
        brick = self.brick
        divisions = sum(control.zero_divisions for control in brick.output.controls)
        divisions += sum(port.zero_divisions for port in brick.input.ports)
        power = brick.io_control.power_command
        supplied = sum(port.supply << number for number, port in enumerate(brick.input.ports))
        return f"power={power:02x} display={brick.display_on:d} inpower={supplied:02x} div0={divisions}"

    def _bluetooth_name(self) -> str:
        return self.brick.radio.stored_name.hex()

    def _high_speed(self, data: str) -> str:
        self.brick.high_speed.arrive(bytes.fromhex(data))
        return "ok"

    def _button(self, mask: str) -> str:
        self.brick.button.hold(int(mask))
        return "ok"

    def _usb(self, plugged: str) -> str:
        self._plugged = plugged != "0"
        if self._plugged:
            self.brick.plug_usb()
            self._late += [self.brick.receive(packet) or b"" for packet in self._held]
            self._held = []
            self._radio.note_command()
        else:
            self.brick.unplug_usb()
        self._hide(_USB_MS)
        return "ok"

    def _fill(self, handle: str, size: str) -> str:
        for start in range(0, _count(size), 58):
            self.telegram(f"0183{handle}" + "5a" * min(58, int(size) - start))
        return "ok"

    def _make_files(self, count: str) -> str:
        for number in range(_count(count)):
            name = f"n{number:03}.t".encode().ljust(20, b"\0").hex()
            reply = self.telegram(f"0181{name}01000000")
            if reply[4:6] != "00":
                return "error"
            self.telegram(f"0183{reply[6:8]}41")
            self.telegram(f"0184{reply[6:8]}")
        return "ok"

    def _reboot(self) -> str:
        self._set_up(self.brick.power_cycle())
        return "ok"

    def _radio_mode(self, mode: str) -> str:
        self._radio.read_on()  # the first pass is one of the former mode
        self._radio.switch(stream=mode == "1")
        self._radio.postpone(_MODE_MS)
        self._hide(_MODE_MS)
        return "ok"

    def _hide(self, passes: int) -> None:
        """Run passes that the recordings do not count; their motors stand still meanwhile."""
        for port in "ABC":
            self.brick.attach_motor(port, None)
        self.brick.tick()
        for _ in range(1, passes):
            self._radio.read_on()
            self.brick.tick()
        self._hidden_ms += passes
        self._plug_in_motors()

    def _plug_in_motors(self) -> None:
        for port, motor in zip("ABC", self.motors, strict=True):
            self.brick.attach_motor(port, motor)

    def _bluetooth(self, *stream: str) -> str:
        """Send bytes over Bluetooth; an incomplete telegram waits for its rest.

        As in the recordings, there is at least one pass for each piece of a telegram that is complete now, even of one
        that was taken before. If the last telegram is complete, passes end when all bytes are taken and sent. They
        last for `_REPLY_TIMEOUT_MS` passes more if the stream ends.
        """
        radio, replies, passes = self._radio, b"", 0
        complete = radio.send(bytes.fromhex("".join(stream)))
        while passes < complete + _REPLY_TIMEOUT_MS and (
            radio.ends
            or radio.sending
            or radio.awaits_answers
            or passes < complete
            or (radio.waiting and not radio.incomplete)
        ):
            replies += radio.take()
            self.brick.tick()
            passes += 1
        return replies.hex()


def _raised_elsewhere(error: Exception) -> bool:
    """Return whether the error was raised outside this module, by the simulated brick."""
    return extract_tb(error.__traceback__)[-1].filename != __file__


def _count(text: str) -> int:
    """Read a number of passes, bytes or files.

    Raises:
        ValueError: It is not a number, or so large that it would take minutes.
    """
    count = int(text)
    if count > MAX_COUNT:
        raise ValueError(f"{count} is more than {MAX_COUNT}")
    return count
