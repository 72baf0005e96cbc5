"""The simulated brick: the firmware's modules, scheduled in passes of one millisecond."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from sim_backend.firmware import io_maps
from sim_backend.firmware.button import Button, ButtonModule
from sim_backend.firmware.comm.dispatch import BluetoothComm, UsbComm
from sim_backend.firmware.comm.file_handlers import FileHandlers
from sim_backend.firmware.comm.handler_result import Handlers, handlers_of
from sim_backend.firmware.comm.identity_handlers import IdentityHandlers
from sim_backend.firmware.comm.input_handlers import InputHandlers
from sim_backend.firmware.comm.module_handlers import ModuleHandlers
from sim_backend.firmware.comm.output_handlers import OutputHandlers
from sim_backend.firmware.comm.program_handlers import ProgramHandlers
from sim_backend.firmware.comm.property_handlers import PropertyHandlers
from sim_backend.firmware.command import CommandModule
from sim_backend.firmware.command_link import CommandLink
from sim_backend.firmware.display import DisplayModule
from sim_backend.firmware.files.flash import Flash
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.high_speed import HighSpeed
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.limits import BLUETOOTH
from sim_backend.firmware.live_map import LiveMap
from sim_backend.firmware.long_read import LongRead
from sim_backend.firmware.mailboxes import Mailboxes
from sim_backend.firmware.module import Clock, Module
from sim_backend.firmware.module_search import ModuleSearch
from sim_backend.firmware.motors.output import MotorPlant, OutputModule
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.radio_tables import RadioTables
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sensors.i2c_sensor import I2CDevice
from sim_backend.firmware.sensors.input import InputModule
from sim_backend.firmware.sensors.input_port import AnalogSensor
from sim_backend.firmware.sensors.low_speed import LowSpeedModule
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui.pages import Modules
from sim_backend.firmware.ui.ui_module import UiModule
from sim_backend.firmware.versions import FIRMWARES, VERSIONS, Version
from sim_backend.firmware.vm.calibrations import Calibrations
from sim_backend.firmware.vm.devices import Devices

BOOT_MS = 6000
"""Passes from power-on until melody and radio have started. Source: docs/firmware.md section 0.1."""

MOTOR_PORTS = ("A", "B", "C")
_SENSOR_PORTS = range(1, 5)
_LONG_MS = 10_000
"""Samples of the battery are skipped only in intervals without events that are longer than this."""


class SimBrick:
    """A brick six seconds after power-on, when it has booted.

    A telegram is handled in the pass that is about to run; time advances only in `tick`. Idle time is cheap: the
    scheduler skips to the next pass in which a module has work.

    Args:
        firmware: "1.29"; "1.05", which lacks some commands and sensors; or "1.32", the community's.
        name: The brick's name, at most 15 characters.
        address: Six bytes: Bluetooth address and USB serial number.
        flash: The `loader.flash` of another brick, to simulate a power cycle; empty by default.
        seed: Seed of the random numbers that programs draw.

    Raises:
        ValueError: The firmware is unknown, or name or address is not as above.

    Attributes:
        firmware: As given.
        output: The motor module.
        input: The module of the four input ports.
        low_speed: The I2C module.
        sound: The loudspeaker's module.
        display: The display with its frame buffer.
        ui: The user interface, with battery and sleep timer.
        button: The four buttons.
        io_control: Commands to the power supply.
        command: The program interpreter's module.
        loader: The file system.
        high_speed: The RS485 port on input 4.
        radio: Name, address, Bluetooth.
        comm: Telegram buffers and dispatch for USB.
        bluetooth: The same for Bluetooth.
    """

    def __init__(
        self,
        *,
        firmware: str = "1.29",
        name: str = "NXT",
        address: bytes = bytes.fromhex("001653010203"),
        seed: int = 0,
        flash: Flash | None = None,
    ) -> None:
        if firmware not in FIRMWARES:
            raise ValueError(f"firmware must be one of {', '.join(FIRMWARES)}, not {firmware!r}")
        version = VERSIONS[firmware]
        self.firmware, self.seed = firmware, seed
        self._clock = clock = Clock(BOOT_MS)
        self.output = OutputModule(clock, version)
        self.input = InputModule(clock, version)
        self.low_speed = LowSpeedModule(clock, self.input.ports, version)
        # without a flash it is as after the first boot
        self.loader = Loader(flash or Flash(version.flash_start, version.sectors, version.directory_size), version)
        self.sound = SoundModule(clock, self.loader)
        self._screen = screen = ScreenRefresh(clock)
        self.io_control = IoControl()
        self.radio = Radio(clock, name.encode("latin-1"), address)
        self.command = CommandModule(
            clock,
            self.loader,
            version.pool,
            version.dialect,
            equip=self._equip,
            on_end=self._program_ended,
            reset_devices=self._reset_devices,
        )
        buttons = [Button() for _ in range(4)]
        self.ui = self._make_ui(version, buttons)
        self.button = ButtonModule(clock, buttons, self.ui.press)
        self.radio.on_plan = self.ui.wake_later
        enhanced = version.dialect.enhanced_calls
        self.display = DisplayModule(self.ui.show_status, screen.show_drawing, screen.drop_drawings, enhanced=enhanced)
        screen.on_erase = self.display.erase
        self._sleepers: tuple[Module, ...] = (self.button, self.low_speed, self.sound, screen, self.command, self.ui)
        link = CommandLink(LongRead(self.loader, self.radio, BLUETOOTH.buffer))
        self.high_speed = HighSpeed(clock, link, version)
        self._maps = self._make_maps(version)
        self._module_search = ModuleSearch(self._maps, self.loader, version.free_flash_at)
        comm_map = self._maps[0]
        handlers = self._handlers(version, link, comm_map)
        self.radio.inbox, self.radio.sends_reply = comm_map.bytes_from("BtInBuf"), link.long_read.sending
        self.radio.show_boot()
        self.comm = UsbComm(handlers, link, version, comm_map.bytes_from("UsbInBuf"))
        self.bluetooth = BluetoothComm(handlers, link, version, self.radio.inbox)

    def _make_ui(self, version: Version, buttons: Sequence[Button]) -> UiModule:
        modules = Modules(
            buttons=buttons,
            screen=self._screen,
            sound=self.sound,
            loader=self.loader,
            inputs=self.input,
            outputs=self.output,
            low_speed=self.low_speed,
            programs=self.command,
            radio=self.radio,
            io_control=self.io_control,
        )
        return UiModule(self._clock, version, modules)

    def _handlers(self, version: Version, link: CommandLink, comm_map: LiveMap) -> Handlers:
        return handlers_of(
            OutputHandlers(self.output),
            InputHandlers(self.input, self.low_speed),
            PropertyHandlers(self.ui, self.sound, self.radio, self.loader, self.command),
            ProgramHandlers(self.command, self.loader, self.ui),
            FileHandlers(self.loader, link),
            ModuleHandlers(self._maps, self._module_search, self.loader, link),
            IdentityHandlers(
                version, self.radio, self.loader, self.high_speed, self.io_control, self._screen, link, comm_map
            ),
        )

    def _make_maps(self, version: Version) -> list[LiveMap]:
        """Return the IO maps, in the firmware's order of modules."""
        maps = [
            io_maps.comm_map(self.radio, self.high_speed, self.ui.registers),
            io_maps.input_map(self.input),
            io_maps.button_map(self.button),
            io_maps.display_map(self.display, self._screen, self.ui),
            io_maps.loader_map(self.loader),
            io_maps.low_speed_map(self.low_speed),
            io_maps.output_map(self.output),
            io_maps.sound_map(self.sound),
            io_maps.io_control_map(self.io_control),
            io_maps.command_map(self.command, self.ui),
            io_maps.ui_map(self.ui, self.radio),
        ]
        for live in maps:
            name = live.layout.name
            live.boot(version.map_sizes.get(name, live.size), version.map_presets.get(name, {}))
        self.radio.tables = RadioTables(maps[0].bytes_from("DeviceName"))
        return maps

    def _equip(self, mailboxes: Mailboxes, calibrations: Calibrations) -> Devices:
        """Return the modules that a program started now can use."""
        self.ui.wake()
        return Devices(
            output=self.output,
            input=self.input,
            low_speed=self.low_speed,
            high_speed=self.high_speed,
            radio=self.radio,
            sound=self.sound,
            ui=self.ui,
            button=self.button,
            display=self.display,
            loader=self.loader,
            maps=self._maps,
            module_search=self._module_search,
            random=Random(self.seed),
            mailboxes=mailboxes,
            started_ms=self.command.tick,
            calibrations=calibrations,
            log_times=lambda: (self.command.sync_time, self.command.sync_tick),
        )

    def _program_ended(self) -> None:
        self.ui.program_ended(had_screen=self.display.end())
        self.radio.end_sending()

    def _reset_devices(self) -> None:
        """Reset ports and motors, as at the start of a program and when the display no longer shows its end."""
        self.button.forget_releases()
        self.input.reset()
        self.low_speed.reset()
        self.output.reset()

    def power_cycle(self) -> SimBrick:
        """Return the brick after the next boot: flash and the radio's settings are kept."""
        brick = SimBrick(
            firmware=self.firmware, address=self.radio.own_address, seed=self.seed, flash=self.loader.flash
        )
        brick.radio.start_from(self.radio)
        brick.ui.status_bar.preset()
        brick.radio.show_boot()
        return brick

    @property
    def serial_number(self) -> str:
        """The USB serial number: the address as 12 hexadecimal digits."""
        return self.radio.address.hex().upper()

    @property
    def now_ms(self) -> int:
        """Milliseconds since power-on."""
        return self._clock.now_ms

    @property
    def display_on(self) -> bool:
        """Whether the display is on; when the brick switches itself off, it goes off before the power."""
        return self._screen.lit

    @property
    def powered_off(self) -> bool:
        """Whether the firmware has switched the brick off; a real one no longer replies."""
        return bool(self.io_control.power_command)

    def receive(self, telegram: bytes) -> bytes | None:
        """Handle one telegram; no time passes.

        Args:
            telegram: At most 64 bytes, the size of a USB packet; further bytes are ignored.

        Returns:
            The reply as LEGO's firmware would send it, or None.
        """
        self.ui.registers.has_cable = True
        self.radio.settle()
        return self.comm.receive(telegram)

    def receive_bluetooth(self, framed: bytes) -> bytes:
        """Handle one telegram that arrived over Bluetooth; no time passes.

        Args:
            framed: Two bytes of length, then the telegram.

        Returns:
            The reply in the same form, or nothing.
        """
        return self.bluetooth.receive_framed(framed)

    def tick(self, passes: int = 1) -> None:
        """Run `passes` milliseconds. A pass that a program sees reads the sensors before it."""
        clock, output, inputs, sleepers = self._clock, self.output, self.input, self._sleepers
        button, low_speed, sound, screen, command, ui = sleepers
        now, end = clock.now_ms, clock.now_ms + passes
        while now < end:  # the modules by name: a loop over them would take longer than their work
            others_ms, command_ms = min(button.due_ms, low_speed.due_ms, sound.due_ms, screen.due_ms), command.due_ms
            if end - now > _LONG_MS and ui.due_ms < others_ms and ui.due_ms < command_ms:
                self.ui.skip_samples(min(end, others_ms, command_ms))
            others_ms = min(others_ms, ui.due_ms)
            wake_ms = min(others_ms, command_ms)
            now += 1
            if output.due_ms <= now:
                alone_ms = min(end + 1, wake_ms, inputs.due_ms)
                if now < alone_ms:  # only the motors have work: most passes of a robot that drives
                    output.run_ahead(now, alone_ms - 1)
                    now = alone_ms
                    if now > end:
                        clock.now_ms = end
                        inputs.run(end)
                        return
            if wake_ms > now:
                now = min(end, max(now, min(inputs.due_ms, output.due_ms, wake_ms)))
            clock.now_ms = now
            if inputs.due_ms <= now or command_ms <= now or now == end:
                inputs.run(now)
            if output.due_ms <= now or now == end:
                output.run(now)
            if command_ms <= now < others_ms:
                now = self._run_program(now, end)
            elif wake_ms <= now:
                for module in sleepers:
                    if module.due_ms <= now:
                        module.run(now)

    def _run_program(self, now: int, end: int) -> int:
        """Run the program's part of a pass, and the following passes while no other module but the ports has work.

        Returns:
            The last of these passes.
        """
        clock, output, inputs, command = self._clock, self.output, self.input, self.command
        button, low_speed, sound, screen, _, ui = self._sleepers
        while True:
            command.run(now)
            if ui.due_ms <= now:
                ui.run(now)
            if command.calculates:
                others = button, low_speed, sound, screen, ui, output, inputs
                now = clock.now_ms = command.run_ahead(now, min(end, *(module.due_ms for module in others)) - 1)
            following = now + 1
            if (
                command.due_ms > following
                or ui.due_ms <= following
                or screen.due_ms <= following
                or sound.due_ms <= following
                or low_speed.due_ms <= following
                or button.due_ms <= following
                or end <= following
            ):
                return now
            now = clock.now_ms = following
            inputs.run(now)
            if output.due_ms <= now:
                output.run(now)

    def attach_motor(self, port: str, plant: MotorPlant | None) -> None:
        """Connect a motor to port "A", "B" or "C"; None disconnects it.

        Raises:
            ValueError: The port is unknown.
        """
        if port not in MOTOR_PORTS:
            raise ValueError(f"motors are plugged into ports {', '.join(MOTOR_PORTS)}, not {port!r}")
        self.output.outputs[MOTOR_PORTS.index(port)].plant = plant
        self.output.wake()

    def attach_sensor(self, port: int, sensor: AnalogSensor | I2CDevice | None) -> None:
        """Connect an analog or I2C sensor to port 1 to 4; None disconnects it.

        Raises:
            ValueError: The port is unknown.
        """
        if port not in _SENSOR_PORTS:
            raise ValueError(f"sensors are plugged into ports 1 to 4, not {port!r}")
        bus, analog = self.low_speed.channels[port - 1].bus, self.input.ports[port - 1]
        digital = sensor if isinstance(sensor, I2CDevice) else None
        bus.connect(digital)
        analog.sensor = None if isinstance(sensor, I2CDevice) else sensor
        self.input.plug_in(analog, sensor)

    def unplug_usb(self) -> None:
        """Pull the USB cable: files opened over it are closed."""
        self.loader.close_all()
        self.ui.registers.has_cable = False

    def plug_usb(self) -> None:
        """Plug the USB cable in again; a telegram over USB does the same."""
        self.ui.registers.has_cable = True

    def set_battery(self, raw: int) -> None:
        """Set the battery's 10-bit converter value, 13.848 mV per step, plus `battery.RECHARGEABLE`."""
        self.ui.set_battery(raw)
