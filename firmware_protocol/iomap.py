"""IO maps: the firmware's own variables, which IOMapRead and IOMapWrite access, declared as data.

A field is found by the firmware's name for it; where a map repeats a group (three motors), an index chooses::

    state = OUTPUT.field("RunState", 1)  # of motor B
    reply = brick.request(state.read())
    value = state.decode(reply.data)

Source of all names, identifiers, sizes and offsets: docs/firmware.md section 5.2. RAM pointers, buffers without a known
inner layout and spare bytes are left out.
"""

from __future__ import annotations

from enum import IntFlag
from typing import Annotated, get_args

from firmware_protocol.enums import OpenEnum
from firmware_protocol.iomap_layout import Array, IOMap, repeated, single
from firmware_protocol.wire import S8, S16, S32, U8, U16, U32, Block, FileName, RunStateField, SensorTypeField, Text


class OutputFlag(IntFlag):
    """Bits of Output's Flags: the values that the firmware applies in its next pass."""

    MODE = 0x01
    SPEED = 0x02
    TACHO_LIMIT = 0x04
    RESET_TACHO_COUNT = 0x08
    PID = 0x10
    RESET_BLOCK_COUNT = 0x20
    RESET_ROTATION_COUNT = 0x40
    PENDING = 0x80


class UiFlag(IntFlag):
    """Bits of Ui's Flags."""

    UPDATE = 0x01
    DISABLE_LEFT_RIGHT_ENTER = 0x02
    DISABLE_EXIT = 0x04
    REDRAW_STATUS = 0x08
    RESET_SLEEP_TIMER = 0x10
    EXECUTE_FILE = 0x20
    BUSY = 0x40
    ENABLE_STATUS = 0x80


class DisplayFlag(IntFlag):
    """Bits of Display's Flags."""

    ON = 0x01
    REFRESH = 0x02
    POPUP = 0x08
    REFRESH_DISABLED = 0x40
    BUSY = 0x80


class SoundState(OpenEnum):
    """Sound's State."""

    IDLE = 0
    FILE = 2
    TONE = 3
    STOP = 4


class ProgramStatus(OpenEnum):
    """Command's ProgStatus."""

    IDLE = 0
    OK = 1
    RUNNING = 2
    ERROR = 3
    ABORTED = 4
    RESET = 5


_TEXT_16 = Annotated[str, Text(16)]
_BYTES_4 = Annotated[bytes, Block(4)]
_ADDRESS = Annotated[bytes, Block(7)]


def _row(number: object, count: int) -> object:
    """Declare `count` numbers, each declared like a single one."""
    return Annotated[list[int], Array(get_args(number)[1], count)]


COMMAND = IOMap(
    "Command.mod",
    0x0001_0001,
    32828,
    single(
        FormatString=(0, _TEXT_16),
        Tick=(20, U32),
        OffsetDS=(24, U16),
        OffsetDVA=(26, U16),
        ProgStatus=(28, U8),
        Awake=(29, U8),
        ActivateFlag=(30, U8),
        DeactivateFlag=(31, U8),
        FileName=(32, FileName),
        MemoryPool=(52, Annotated[bytes, Block(32768)]),
        SyncTime=(32820, U32),
        SyncTick=(32824, U32),
    ),
    size_1_05=32820,
)

OUTPUT = IOMap(
    "Output.mod",
    0x0002_0001,
    100,
    repeated(
        3,
        32,
        0,
        TachoCount=(0, S32),
        BlockTachoCount=(4, S32),
        RotationCount=(8, S32),
        TachoLimit=(12, U32),
        Flags=(18, U8),
        Mode=(19, U8),
        Speed=(20, S8),
        ActualSpeed=(21, S8),
        RegPParameter=(22, U8),
        RegIParameter=(23, U8),
        RegDParameter=(24, U8),
        RunState=(25, RunStateField),
        RegMode=(26, U8),
        Overloaded=(27, U8),
        SyncTurnParameter=(28, S8),
        Options=(29, U8),
        MaxSpeed=(30, S8),
        MaxAcceleration=(31, S8),
    )
    | single(PwmFreq=(96, U8), RegulationOptions=(97, U8)),
)
"""To start a motor through the map write Flags to RunState in one access; see `IOMap.between`."""

INPUT = IOMap(
    "Input.mod",
    0x0003_0001,
    416,
    repeated(
        4,
        20,
        0,
        CustomZeroOffset=(0, U16),
        ADRaw=(2, U16),
        SensorRaw=(4, U16),
        SensorValue=(6, S16),
        SensorType=(8, SensorTypeField),
        SensorMode=(9, U8),
        SensorBoolean=(10, U8),
        DigiPinsDir=(11, U8),
        DigiPinsIn=(12, U8),
        DigiPinsOut=(13, U8),
        CustomPctFullScale=(14, U8),
        CustomActiveStatus=(15, U8),
        InvalidData=(16, U8),
    )
    | repeated(
        4,
        84,
        80,
        ColorCalibration=(0, _row(U32, 12)),
        ColorCalLimits=(48, _row(U16, 2)),
        ColorADRaw=(52, _row(U16, 4)),
        ColorSensorRaw=(60, _row(U16, 4)),
        ColorSensorValue=(68, _row(S16, 4)),
        ColorBoolean=(76, _row(U8, 4)),
        ColorCalibrationState=(80, U8),
    ),
    size_1_05=80,
)
"""Rows of four are red, green, blue and blank; firmware 1.05 ends before the colour fields."""

BUTTON = IOMap(
    "Button.mod",
    0x0004_0001,
    36,
    repeated(
        4,
        8,
        0,
        PressedCnt=(0, U8),
        LongPressCnt=(1, U8),
        ShortRelCnt=(2, U8),
        LongRelCnt=(3, U8),
        RelCnt=(4, U8),
    )
    | repeated(4, 1, 32, State=(0, U8)),
)
"""Buttons are numbered exit, right, left, enter."""

COMM = IOMap(
    "Comm.mod",
    0x0005_0001,
    1896,
    repeated(
        30,
        31,
        8,
        DeviceName=(0, _TEXT_16),
        DeviceClass=(16, _BYTES_4),
        DeviceAddress=(20, _ADDRESS),
        DeviceStatus=(27, U8),
    )
    | repeated(
        4,
        47,
        938,
        ConnectionName=(0, _TEXT_16),
        ConnectionClass=(16, _BYTES_4),
        ConnectionPin=(20, _TEXT_16),
        ConnectionAddress=(36, _ADDRESS),
        ConnectionHandle=(43, U8),
        ConnectionStream=(44, U8),
        ConnectionQuality=(45, U8),
    )
    | single(
        BrickName=(1126, _TEXT_16),
        BluecoreVersion=(1142, Annotated[bytes, Block(2)]),
        BrickAddress=(1144, _ADDRESS),
        BtState=(1151, U8),
        BtHwStatus=(1152, U8),
        BtTimeOut=(1153, U8),
        BtInBuf=(1157, Annotated[bytes, Block(128)]),
        BtOutBuf=(1289, Annotated[bytes, Block(128)]),
        HsInBuf=(1421, Annotated[bytes, Block(128)]),
        HsInPtr=(1549, U8),
        HsOutPtr=(1550, U8),
        HsOutBuf=(1553, Annotated[bytes, Block(128)]),
        HsSendInPtr=(1681, U8),
        HsSendOutPtr=(1682, U8),
        UsbInBuf=(1685, Annotated[bytes, Block(64)]),
        UsbOutBuf=(1753, Annotated[bytes, Block(64)]),
        DeviceCnt=(1889, U8),
        HsFlags=(1891, U8),
        HsSpeed=(1892, U8),
        HsState=(1893, U8),
        UsbState=(1894, U8),
    ),
)

IOCTRL = IOMap("IOCtrl.mod", 0x0006_0001, 2, single(PowerOn=(0, U16)))
"""Dangerous to write: 0x5A00 switches off, 0xA55A boots the loader."""

SOUND = IOMap(
    "Sound.mod",
    0x0008_0001,
    30,
    single(
        Freq=(0, U16),
        Duration=(2, U16),
        SampleRate=(4, U16),
        SoundFilename=(6, FileName),
        Flags=(26, U8),
        State=(27, U8),
        Mode=(28, U8),
        Volume=(29, U8),
    ),
)

LOADER = IOMap("Loader.mod", 0x0009_0001, 8, single(FreeUserFlash=(4, U32)))

DISPLAY_WIDTH, DISPLAY_HEIGHT = 100, 64
"""Pixels."""

DISPLAY = IOMap(
    "Display.mod",
    0x000A_0001,
    1720,
    single(
        EraseMask=(4, U32),
        UpdateMask=(8, U32),
        StatusIcons=(108, Annotated[bytes, Block(4)]),
        StepIcons=(112, Annotated[bytes, Block(5)]),
        Flags=(117, U8),
        TextLinesCenterFlags=(118, U8),
    )
    | repeated(
        8,
        DISPLAY_WIDTH,
        119,
        Normal=(0, Annotated[bytes, Block(DISPLAY_WIDTH)]),
        Popup=(800, Annotated[bytes, Block(DISPLAY_WIDTH)]),
    ),
)
"""A line of the framebuffer is 8 pixels high: one byte per column, its lowest bit on top; see `pixel`."""

LOW_SPEED = IOMap(
    "Low Speed.mod",
    0x000B_0001,
    167,
    repeated(
        4,
        19,
        0,
        InBuf=(0, Annotated[bytes, Block(16)]),
        InPtr=(16, U8),
        OutPtr=(17, U8),
        BytesToRx=(18, U8),
        OutBuf=(76, Annotated[bytes, Block(16)]),
        OutBufInPtr=(92, U8),
        OutBufOutPtr=(93, U8),
        OutBufBytesToRx=(94, U8),
    )
    | repeated(4, 1, 152, Mode=(0, U8), ChannelState=(4, U8), ErrorType=(8, U8))
    | single(State=(164, U8), Speed=(165, U8), NoRestart=(166, U8)),
)

UI = IOMap(
    "Ui.mod",
    0x000C_0001,
    40,
    single(
        BatteryVoltage=(4, U16),
        LMSfilename=(6, FileName),
        Flags=(26, U8),
        State=(27, U8),
        Button=(28, U8),
        RunState=(29, U8),
        BatteryState=(30, U8),
        BluetoothState=(31, U8),
        UsbState=(32, U8),
        SleepTimeout=(33, U8),
        SleepTimer=(34, U8),
        Rechargeable=(35, U8),
        Volume=(36, U8),
        Error=(37, U8),
        OBPPointer=(38, U8),
        ForceOff=(39, U8),
    ),
)
"""Write Button to press one, ForceOff to switch off; Flags has bit `UiFlag.BUSY` while StartProgram would be lost."""

IO_MAPS = {
    io_map.module_id: io_map
    for io_map in (COMMAND, OUTPUT, INPUT, BUTTON, COMM, IOCTRL, SOUND, LOADER, DISPLAY, LOW_SPEED, UI)
}
"""All of them by module id."""
