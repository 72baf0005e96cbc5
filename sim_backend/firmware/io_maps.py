"""The IO maps of the modules, with their live variables. Source: docs/firmware.md section 5.2."""

from __future__ import annotations

from firmware_protocol import iomap
from sim_backend.firmware.button import ButtonModule
from sim_backend.firmware.command import CommandModule
from sim_backend.firmware.display import DisplayModule
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.high_speed import HighSpeed
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.live_map import LiveMap
from sim_backend.firmware.motors.output import OutputModule
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sensors.input import InputModule
from sim_backend.firmware.sensors.low_speed import LowSpeedModule
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.ui_module import UiModule

_BLUECORE_VERSION = b"\1\0"


def output_map(module: OutputModule) -> LiveMap:
    """Make the map of the motors; commands take effect through the flags in the next pass."""
    live = LiveMap(iomap.OUTPUT, on_write=module.wake)
    for i, output in enumerate(module.outputs):
        live.bind(
            output,
            index=i,
            TachoCount="count",
            BlockTachoCount="block",
            RotationCount="rotation",
            ActualSpeed="actual_speed",
            Overloaded="overloaded",
            TachoLimit="tacho_limit",
            Flags="flags",
            Mode="mode",
            Speed="power",
            RegPParameter="p_gain",
            RegIParameter="i_gain",
            RegDParameter="d_gain",
            RunState="run_state",
            RegMode="regulation",
            SyncTurnParameter="turn",
            Options="options",
            MaxSpeed="max_speed",
            MaxAcceleration="max_acceleration",
        )
    live.bind(module, PwmFreq="common_byte", RegulationOptions="regulation_options")
    return live


def input_map(module: InputModule) -> LiveMap:
    """Make the map of the sensors; types and modes written here act like commanded ones."""
    live = LiveMap(iomap.INPUT, on_write=module.wake)
    for i, port in enumerate(module.ports):
        live.bind(
            port,
            index=i,
            CustomZeroOffset="custom_zero_offset",
            ADRaw="raw",
            SensorRaw="normalized",
            SensorValue="scaled",
            SensorType="type",
            SensorMode="mode",
            SensorBoolean="boolean",
            DigiPinsDir="pin_directions",
            DigiPinsIn="pins_in",
            DigiPinsOut="pins_out",
            CustomPctFullScale="custom_full_scale",
            CustomActiveStatus="custom_active",
            InvalidData="invalid",
        )
        live.bind(
            port.color,
            index=i,
            ColorCalibration="calibration",
            ColorCalLimits="limits",
            ColorADRaw="readings",
            ColorSensorRaw="normalized",
            ColorSensorValue="scaled",
            ColorBoolean="booleans",
            ColorCalibrationState="state",
        )
    return live


def low_speed_map(module: LowSpeedModule) -> LiveMap:
    """Make the map of I2C. Transactions start by telegrams, or by writing a buffer, a state and then the port's bit."""
    live = LiveMap(iomap.LOW_SPEED, on_write=module.wake)
    for i, channel in enumerate(module.channels):
        live.bind(
            channel,
            index=i,
            InBuf="rx",
            InPtr="rx_in",
            OutPtr="rx_out",
            BytesToRx="rx_size",
            OutBuf="tx",
            OutBufInPtr="tx_size",
            OutBufOutPtr="tx_out",
            OutBufBytesToRx="tx_spare",
            Mode="mode",
            ChannelState="state",
            ErrorType="error",
        )
    live.bind(module, State="active", Speed="at_once", NoRestart="no_restart")
    return live


def sound_map(module: SoundModule) -> LiveMap:
    """Make the map of tone, sound file and volume."""
    live = LiveMap(iomap.SOUND, on_write=module.wake)
    live.bind(
        module,
        Freq="frequency_hz",
        Duration="duration_ms",
        SampleRate="sample_rate",
        SoundFilename="name",
        Flags="flags",
        State="state",
        Mode="mode",
        Volume="volume",
    )
    return live


def ui_map(module: UiModule, radio: Radio) -> LiveMap:
    """Make the map of the user interface; the pointer at the start of the map is not simulated."""
    live = LiveMap(iomap.UI, on_write=module.wake)
    live.bind(module.registers, LMSfilename="program_name", Flags="flags", State="state")
    live.bind(
        module.registers,
        Button="button",
        RunState="run_state",
        Error="error",
        OBPPointer="pointer",
        ForceOff="force_off",
        Volume="volume",
    )
    live.bind(module.sleep_timer, SleepTimeout="limit_minutes", SleepTimer="minutes")
    live.show(module.registers, UsbState="usb_state")
    live.bind(radio, BluetoothState="state")
    live.bind(module.battery, BatteryVoltage="millivolts", BatteryState="bars", Rechargeable="rechargeable")
    return live


def comm_map(radio: Radio, high_speed: HighSpeed, registers: UiRegisters) -> LiveMap:
    """Make the map of the brick's identity; the tables of known and connected devices are empty."""

    def clear_second() -> None:
        live.bytes_from("BtInBuf")[1] = 0

    live = LiveMap(iomap.COMM, on_write=clear_second)
    live.bind(radio, BrickName="name", BrickAddress="address")
    live.show(radio, BtInBuf="received")
    live.bind(radio, BtState="link_state", BtHwStatus="resetting")
    live.bind(high_speed, HsFlags="flags", HsState="state", HsInBuf="ring", HsInPtr="ring_in", HsOutPtr="ring_out")
    live.bind(high_speed, HsSendInPtr="to_send", HsSendOutPtr="sent")
    live.show(registers, UsbState="has_cable")
    live.preset("BluecoreVersion", _BLUECORE_VERSION)
    return live


def command_map(module: CommandModule, ui: UiModule) -> LiveMap:
    """Make the map of the program interpreter and the memory pool; writing to it can start and stop programs."""

    def wake() -> None:
        module.wake()
        ui.wake()

    live = LiveMap(iomap.COMMAND, on_write=wake)
    live.bind(module, Tick="tick")
    live.bind(module.offsets, OffsetDS="variables", OffsetDVA="descriptors")
    live.bind(
        module,
        ProgStatus="status",
        ActivateFlag="activate",
        DeactivateFlag="deactivate",
        FileName="file_name",
        MemoryPool="pool",
        SyncTime="sync_time",
        SyncTick="sync_tick",
    )
    live.preset("FormatString", "MindstormsNXT")
    live.preset("Awake", 1)
    return live


def display_map(module: DisplayModule, refresh: ScreenRefresh, ui: UiModule) -> LiveMap:
    """Make the map of the display with its frame buffer; the user interface may remove some of what is written."""

    def wake() -> None:
        refresh.wake()
        ui.wake()

    live = LiveMap(iomap.DISPLAY, memory=module.memory, on_write=wake)
    live.bind(ui.status_bar, StatusIcons="icons")
    live.bind(ui.program_steps, StepIcons="icons")
    live.bind(
        refresh, EraseMask="erase_mask", UpdateMask="update_mask", Flags="flags", TextLinesCenterFlags="centered_lines"
    )
    return live


def loader_map(loader: Loader) -> LiveMap:
    """Make the map of the free flash."""
    live = LiveMap(iomap.LOADER)
    live.bind(loader, FreeUserFlash="free_flash")
    return live


def io_control_map(module: IoControl) -> LiveMap:
    """Make the map of commands to the power supply."""
    live = LiveMap(iomap.IOCTRL)
    live.bind(module, PowerOn="power_word")
    return live


def button_map(module: ButtonModule) -> LiveMap:
    """Make the map of the counters and states of the four buttons."""
    live = LiveMap(iomap.BUTTON, on_write=module.note_write)
    for i, button in enumerate(module.buttons):
        live.bind(
            button,
            index=i,
            PressedCnt="presses",
            LongPressCnt="long_presses",
            ShortRelCnt="short_releases",
            LongRelCnt="long_releases",
            RelCnt="releases",
            State="state",
        )
    return live
