"""The direct commands, 0x00 to 0x21: what a program or a remote control does with a running brick.

Source of all opcodes, layouts and remarks: docs/firmware.md section 4. Opcodes 0x12, 0x14 to 0x18 and those from 0x26
on are answered with UNKNOWN_OPCODE by every known firmware and therefore not declared; `enhanced` has the others.

No ``from __future__ import annotations`` here: the declarations' annotations are read as objects.
"""

from typing import Annotated, Self

from firmware_protocol.enums import InputPort, Property
from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.status import Status
from firmware_protocol.telegram import Ack, Command, Reply, counted_reply, direct, reply
from firmware_protocol.wire import (
    S16,
    U8,
    U16,
    U32,
    Block,
    Bool,
    Degrees,
    DegreesLimit,
    FileName,
    Hertz,
    InputPortField,
    Milliseconds16,
    Milliseconds32,
    Millivolts,
    OutputModeField,
    OutputPortField,
    Percent,
    PropertyField,
    RegulationModeField,
    RunStateField,
    SensorModeField,
    SensorTypeField,
    Tail,
    Text,
)

MESSAGE_LIMIT = 59
"""Most bytes of a mailbox message, its closing zero included (docs/firmware.md section 4, 0x09)."""

RECORD_LIMIT = 60
"""Most bytes of a record of the data log (docs/firmware.md section 8.4)."""

LS_LIMIT = 16
"""Most bytes of an I2C transaction in either direction; 16 received are lost (docs/firmware.md section 1, fact 10)."""


@direct(0x00)
class StartProgram(Command[Ack]):
    """Start a program. OK does not mean that it runs: the user interface may be busy (docs/firmware.md section 1)."""

    name: FileName


@direct(0x01)
class StopProgram(Command[Ack]):
    """Stop the running program; NO_ACTIVE_PROGRAM if none runs."""


@direct(0x02)
class PlaySoundFile(Command[Ack]):
    """Play a sound file; OUT_OF_RANGE if it does not exist."""

    loop: Bool
    name: FileName


@direct(0x03)
class PlayTone(Command[Ack]):
    """Play a tone; the firmware clamps it to 220..14080 Hz and at least 10 ms."""

    frequency_hz: Hertz
    duration_ms: Milliseconds16


@direct(0x04)
class SetOutputState(Command[Ack]):
    """Command one motor, or all of them with port ALL. The firmware checks only the port."""

    port: OutputPortField
    power: Percent  # -100..100; the motor chip saturates beyond
    mode: OutputModeField
    regulation: RegulationModeField  # counts only with mode bit REGULATED
    turn_ratio: Percent  # for SYNC: 50 about stops the lower port's wheel, 100 turns on the spot
    run_state: RunStateField  # run, or ramp towards `power`
    tacho_limit: DegreesLimit  # to go from the last target, 0 for no limit


@direct(0x05)
class SetInputMode(Command[Ack]):
    """Set a sensor's type and the scale of its values; they are invalid for 20 to 400 ms after a change of type."""

    port: InputPortField
    type: SensorTypeField
    mode: SensorModeField


@reply
class OutputState(Reply):
    """One motor, as of the firmware's previous 1 ms pass; power to turn ratio and the limit are as commanded."""

    port: OutputPortField  # echo
    power: Percent
    mode: OutputModeField
    regulation: RegulationModeField
    turn_ratio: Percent
    run_state: RunStateField  # live
    tacho_limit: DegreesLimit  # 0 is no limit
    tacho_count: Degrees  # since the last motor reset; basis of the limit
    block_tacho_count: Degrees  # since the last block reset; basis of synchronisation
    rotation_count: Degrees  # since the last rotation reset; the one for odometry


@direct(0x06)
class GetOutputState(Command[OutputState]):
    """Read one motor. For ports other than A, B, C the reply is OUT_OF_RANGE and zeros."""

    port: OutputPortField


@reply
class InputValues(Reply):
    """One input port."""

    port: InputPortField  # echo
    valid: Bool  # the values belong to the type set; false for 20 to 400 ms after it changed
    calibrated: Bool  # always false
    type: SensorTypeField  # as commanded
    mode: SensorModeField  # as commanded
    raw: U16  # of the converter, 0..1023
    normalized: U16  # by the sensor's type, 0..1023
    scaled: S16  # by the sensor's mode
    calibrated_value: S16  # always `normalized`


@direct(0x07)
class GetInputValues(Command[InputValues]):
    """Read one input port. For ports beyond 3 the reply is OUT_OF_RANGE and zeros."""

    port: InputPortField


@direct(0x08)
class ResetInputScaledValue(Command[Ack]):
    """Clear the scaled value, for the modes that count."""

    port: InputPortField


@direct(0x09)
class MessageWrite(Command[Ack]):
    """Put a message into a mailbox of the running program; the sixth message pushes out the oldest."""

    box: U8  # 0..9 towards the program, 10..19 the program's own
    size: U8  # bytes of `data`, the closing zero included, 1..59
    data: Annotated[bytes, Tail(MESSAGE_LIMIT)]  # the last byte must be zero

    @classmethod
    def text(cls, box: int, message: str) -> Self:
        """Make a message of at most 58 Latin-1 characters; size and closing zero are added.

        Raises:
            LocalProtocolError: It is longer, or has other characters.
        """
        try:
            data = message.encode("latin-1") + b"\0"
        except (AttributeError, UnicodeEncodeError):
            raise LocalProtocolError(f"message must be text in Latin-1 characters, not {message!r}.") from None
        if len(data) > MESSAGE_LIMIT:
            raise LocalProtocolError(f"message must have at most {MESSAGE_LIMIT - 1} characters, not {len(message)}.")
        return cls(box, len(data), data)


@direct(0x0A)
class ResetMotorPosition(Command[Ack]):
    """Zero a counter: BlockTachoCount if relative, else RotationCount; TachoCount stays (see `UpdateResetCount`)."""

    port: OutputPortField
    relative: Bool


@reply
class BatteryLevel(Reply):
    """`voltage_mv`: Battery voltage, refreshed every 167 ms."""

    voltage_mv: Millivolts


@direct(0x0B)
class GetBatteryLevel(Command[BatteryLevel]):
    """Read the battery's voltage."""


@direct(0x0C)
class StopSoundPlayback(Command[Ack]):
    """Stop sound files and tones; always OK."""


@reply
class SleepLimit(Reply):
    """`sleep_ms`: Time without a key press or KeepAlive after which the brick switches off; 0 is never."""

    sleep_ms: Milliseconds32


@direct(0x0D)
class KeepAlive(Command[SleepLimit]):
    """Restart the sleep timer; other traffic does not (docs/firmware.md section 1, fact 5)."""


@reply
class LSStatus(Reply):
    """`bytes_ready`: Received bytes waiting for `LSRead`."""

    bytes_ready: U8


@direct(0x0E)
class LSGetStatus(Command[LSStatus]):
    """Read the state of a port's I2C bus: OK idle, PENDING busy, BUS_ERROR until the next `LSWrite`."""

    port: InputPortField


@direct(0x0F)
class LSWrite(Command[Ack]):
    """Start an I2C transaction on a port that has been LOW_SPEED or LOW_SPEED_9V for 20 ms."""

    port: InputPortField
    tx_length: U8  # bytes of `data`, 1..16
    rx_length: U8  # bytes to read afterwards, 0..15
    data: Annotated[bytes, Tail(LS_LIMIT)]  # the device's 8-bit write address, then what to write

    @classmethod
    def transaction(cls, port: InputPort, tx_data: bytes, rx_length: int = 0) -> Self:
        """Write `tx_data`, then read `rx_length` bytes; the length of the data is counted here."""
        return cls(port, len(tx_data), rx_length, tx_data)


@counted_reply("count")
class LSData(Reply):
    """The bytes that an I2C transaction received: the first `count` of `data`; see `received`."""

    count: U8
    data: Annotated[bytes, Block(LS_LIMIT)]

    @property
    def received(self) -> bytes:
        """The received bytes, without the padding."""
        return self.data[: self.count]


@direct(0x10, success=(Status.OK, Status.PENDING))
class LSRead(Command[LSData]):
    """Fetch received bytes, also during a transaction; PENDING only if none wait (docs/firmware.md section 7)."""

    port: InputPortField


@reply
class CurrentProgram(Reply):
    """`name`: File name as given to `StartProgram`."""

    name: FileName


@direct(0x11)
class GetCurrentProgramName(Command[CurrentProgram]):
    """Read the name of the running program; NO_ACTIVE_PROGRAM if none runs."""


@counted_reply("size")
class MailboxMessage(Reply):
    """A message out of a mailbox; see `text`."""

    local_box: U8  # echo
    size: U8  # bytes of `data` that count, the closing zero included; 0 if there is no message
    data: Annotated[bytes, Block(MESSAGE_LIMIT)]

    @property
    def text(self) -> str:
        """The message up to its closing zero."""
        return self.data[: self.size].split(b"\0", 1)[0].decode("latin-1")


@direct(0x13)
class MessageRead(Command[MailboxMessage]):
    """Fetch a message that the running program has sent."""

    remote_box: U8  # on the brick, 0..19
    local_box: U8  # where the reader stores the message; only echoed
    remove: Bool  # false leaves the message in its box


@counted_reply("size")
class DatalogRecord(Reply):
    """A data log entry; of `data`, `size` bytes count."""

    size: U8
    data: Annotated[bytes, Block(RECORD_LIMIT)]


@direct(0x19, since="1.28")
class DatalogRead(Command[DatalogRecord]):
    """Fetch data that a running program logs; MAILBOX_EMPTY if there is none."""

    remove: Bool


@direct(0x1A, since="1.28")
class DatalogSetTimes(Command[Ack]):
    """Set the clock of the data log; it appears as SyncTime in the Command IO map."""

    sync_time: U32


@reply
class BluetoothCount(Reply):
    """`count`: Entries of the table."""

    count: U8


@reply
class BluetoothName(Reply):
    """An entry of a Bluetooth table; `device_type` 0 if there is none."""

    device_type: U8
    name: Annotated[str, Text(17)]


@direct(0x1B, since="1.28")
class GetBluetoothContactCount(Command[BluetoothCount]):
    """Read the size of the table of known devices: 30."""


@direct(0x1C, since="1.28")
class GetBluetoothContactName(Command[BluetoothName]):
    """Read one entry of the table of known devices."""

    index: U8


@direct(0x1D, since="1.28")
class GetBluetoothConnectionCount(Command[BluetoothCount]):
    """Read the size of the table of connections: 4."""


@direct(0x1E, since="1.28")
class GetBluetoothConnectionName(Command[BluetoothName]):
    """Read one entry of the table of connections."""

    index: U8


@direct(0x1F, success=(Status.OK, Status.IN_PROGRESS), since="1.28")
class SetProperty(Command[Ack]):
    """Change a setting until power-off; the reply for an unknown one is UNKNOWN_OPCODE."""

    property: PropertyField
    value: Annotated[bytes, Tail(4)]  # one byte; for SLEEP_TIME four

    @classmethod
    def volume(cls, level: int) -> Self:
        """Set the loudness, 0..255; the firmware clamps it to 4. Raises LocalProtocolError for any other value."""
        if not (isinstance(level, int) and 0 <= level <= 0xFF):
            raise LocalProtocolError(f"level must be a whole number from 0 to 255, not {level!r}.")
        return cls(Property.VOLUME, bytes((level,)))


@reply
class PropertyValue(Reply):
    """`value`: One byte; for SLEEP_TIME four, milliseconds."""

    value: Annotated[bytes, Tail(4)]

    @property
    def number(self) -> int:
        """The value as a number."""
        return int.from_bytes(self.value, "little")


@direct(0x20, since="1.28")
class GetProperty(Command[PropertyValue]):
    """Read a setting."""

    property: PropertyField


@direct(0x21, since="1.28")
class UpdateResetCount(Command[Ack]):
    """Zero TachoCount and the basis of the tacho limit; do it before every limited move (section 1, fact 12)."""

    port: OutputPortField
