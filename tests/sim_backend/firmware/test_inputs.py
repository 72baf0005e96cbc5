"""Rules of the input module, each as a short conversation with the answers of LEGO's firmware."""

import pytest

from firmware_protocol.direct import GetInputValues, ResetInputScaledValue, SetInputMode
from firmware_protocol.enums import InputPort, SensorMode, SensorType
from firmware_protocol.iomap import INPUT
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import FIRMWARES

EXIT = 18


class Conversation:
    """A bench with one sensor on port 1."""

    def __init__(self, firmware: str = "1.29") -> None:
        self.bench = Bench(SimBrick(firmware=firmware))

    def hold(self, raw: int, passes: int = 1) -> int:
        """Set the converter's value and wait; returns the scaled value."""
        self.bench.control(f"!sensor 0 {raw}")
        self.bench.control(f"!tick {passes}")
        return self.values().scaled

    def set(self, sensor_type: int, mode: int = SensorMode.RAW, passes: int = 30) -> None:
        self.bench.telegram(SetInputMode(InputPort.IN_1, SensorType(sensor_type), SensorMode(mode)).encode().hex())
        self.bench.control(f"!tick {passes}")

    def values(self):
        reply = bytes.fromhex(self.bench.telegram(GetInputValues(InputPort.IN_1).encode().hex()))
        return GetInputValues.reply_type.unpack(reply)

    def reset(self) -> None:
        self.bench.telegram(ResetInputScaledValue(InputPort.IN_1).encode().hex())

    def put(self, **fields: int) -> None:
        for name, value in fields.items():
            self.bench.telegram(INPUT.field(name).write(value).encode().hex())

    def field(self, name: str) -> int:
        spot = INPUT.field(name)
        return spot.decode(bytes.fromhex(self.bench.telegram(spot.read().encode().hex()))[9:])

    def passes_until_valid(self, sensor_type: int) -> int:
        self.set(sensor_type, passes=0)
        return next(passes for passes in range(500) if self.values().valid)


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize(
    ("raw", "normalized"), [(0, 1023), (291, 1018), (301, 984), (461, 647), (582, 486), (687, 361), (927, 2), (1023, 0)]
)
def test_temperatures_follow_the_measured_table(firmware, raw, normalized):
    talk = Conversation(firmware)
    talk.set(SensorType.TEMPERATURE)
    talk.hold(raw)
    assert talk.values().normalized == normalized


@pytest.mark.parametrize(
    ("zero", "percent", "raw", "normalized"),
    [(0, 0, 400, 0), (100, 50, 400, 600), (100, 50, 50, 0), (100, 255, 120, 7), (0, 41, 800, 1023), (0xFFFF, 50, 9, 0)],
)
def test_the_scale_of_a_custom_sensor_is_in_the_map(zero, percent, raw, normalized):
    talk = Conversation()
    talk.put(CustomZeroOffset=zero, CustomPctFullScale=percent)
    talk.set(SensorType.CUSTOM)
    assert talk.hold(raw) == normalized
    assert talk.values().raw == raw


@pytest.mark.parametrize(
    ("directions", "out", "pins"), [(0, 0, 3), (1, 0, 2), (1, 1, 3), (2, 0, 1), (3, 0, 0), (3, 2, 2), (0xFF, 0xFD, 1)]
)
def test_a_custom_sensor_drives_its_pins(directions, out, pins):
    talk = Conversation()
    talk.put(DigiPinsDir=directions, DigiPinsOut=out, DigiPinsIn=0x54)
    talk.set(SensorType.CUSTOM)
    assert talk.field("DigiPinsIn") == 0x54 | pins


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize(
    ("before", "level"),
    [(SensorType.SWITCH, 3), (SensorType.ANGLE, 2), (SensorType.SOUND_DBA, 2), (SensorType.LOW_SPEED, 3)],
)
def test_an_undriven_first_pin_keeps_the_level_of_the_type_before(firmware, before, level):
    talk = Conversation(firmware)
    talk.set(before)
    talk.set(SensorType.CUSTOM)
    assert talk.field("DigiPinsIn") == (3 if firmware == "1.32" else level)


@pytest.mark.parametrize(
    ("mode", "counts"),
    [(SensorMode.TRANSITION_COUNT, [1, 2, 3, 4, 5, 6]), (SensorMode.PERIOD_COUNT, [0, 1, 1, 2, 2, 3])],
)
def test_edges_far_apart_are_counted(mode, counts):
    talk = Conversation()
    talk.hold(1000)
    talk.set(SensorType.SWITCH, mode)
    assert [talk.hold(raw, 120) for raw in (200, 1000) * 3] == counts


def test_edges_soon_after_another_are_lost():
    talk = Conversation()
    talk.hold(1000)
    talk.set(SensorType.SWITCH, SensorMode.TRANSITION_COUNT)
    assert [talk.hold(raw, 30) for raw in (200, 1000, 200, 1000, 200, 1000, 200, 1000, 1000)] == [
        1,
        1,
        1,
        1,
        2,
        2,
        2,
        2,
        2,
    ]


@pytest.mark.parametrize(("passes", "count"), [(100, 1), (101, 2)])
def test_the_101st_pass_after_an_edge_counts_again(passes, count):
    talk = Conversation()
    talk.hold(1000)
    talk.set(SensorType.SWITCH, SensorMode.TRANSITION_COUNT)
    talk.bench.control("!sensor 0 200")
    talk.bench.control(f"!tick {passes}")
    assert talk.hold(1000, 2) == count


def test_a_period_ends_with_the_first_fall_after_two_edges():
    talk = Conversation()
    talk.hold(200)
    talk.set(SensorType.SWITCH)
    talk.set(SensorType.SWITCH, SensorMode.PERIOD_COUNT)
    assert [talk.hold(raw, 120) for raw in (1000, 200, 1000)] == [200, 200, 201]
    talk.hold(200, 120)
    talk.set(SensorType.ANGLE, SensorMode.PERIOD_COUNT)  # a new type forgets the edge
    assert [talk.hold(raw, 120) for raw in (1000, 200, 1000)] == [201, 201, 202]


def test_the_first_reading_of_a_new_type_can_be_an_edge():
    talk = Conversation()
    talk.hold(1000)
    talk.set(SensorType.REFLECTION, SensorMode.TRANSITION_COUNT)
    assert talk.values().scaled == 1


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize(
    ("bands", "steps"),
    [
        ((300, 566, 1000, 800, 300), [1, 2, 3, 4]),
        ((300, 800, 1000, 566, 300), [-1, -2, -3, -4]),
        ((300, 566, 800, 1000, 300, 566), [1, 1, 2, 2, 1]),  # the opposite band changes nothing
    ],
)
def test_a_rotation_sensor_counts_sixteenths(firmware, bands, steps):
    talk = Conversation(firmware)
    first, *others = bands
    talk.hold(first)
    talk.set(SensorType.ANGLE, SensorMode.ANGLE_STEPS)
    talk.reset()
    assert [talk.hold(raw, 2) for raw in others] == steps


@pytest.mark.parametrize(("standstill", "passes"), [(28, 1), (29, 7), (500, 7)])
def test_after_a_standstill_in_an_outer_band_a_step_must_last(standstill, passes):
    talk = Conversation()
    talk.hold(300)
    talk.set(SensorType.ANGLE, SensorMode.ANGLE_STEPS, passes=20 + standstill)
    talk.bench.control("!sensor 0 566")
    assert [talk.values().scaled for _ in range(8)].index(1) == passes
    assert [talk.hold(300, 20), talk.hold(566)] == [0, 1]


def test_a_step_after_a_standstill_may_be_interrupted():
    talk = Conversation()
    talk.hold(300)
    talk.set(SensorType.ANGLE, SensorMode.ANGLE_STEPS, passes=80)
    assert [talk.hold(566, 3), talk.hold(300, 90), talk.hold(566, 1), talk.hold(566, 1)] == [0, 0, 0, 1]


@pytest.mark.parametrize(
    ("firmware", "sensor_type", "then", "passes"),
    [
        ("1.29", SensorType.SWITCH, SensorType.TEMPERATURE, 20),
        ("1.29", SensorType.SOUND_DB, SensorType.SOUND_DBA, 300),
        ("1.29", SensorType.NONE, 100, 20),
        ("1.05", SensorType.SWITCH, SensorType.TEMPERATURE, 1),
        ("1.05", SensorType.REFLECTION, SensorType.ANGLE, 1),
        ("1.05", SensorType.LIGHT_ACTIVE, SensorType.SOUND_DB, 1),
        ("1.05", SensorType.LIGHT_INACTIVE, 200, 1),
        ("1.05", SensorType.SOUND_DB, SensorType.SOUND_DBA, 300),
        ("1.05", SensorType.SWITCH, SensorType.SOUND_DB, 300),
        ("1.05", SensorType.LOW_SPEED, SensorType.LOW_SPEED_9V, 20),
        ("1.05", SensorType.CUSTOM, SensorType.NONE, 20),
    ],
)
def test_how_long_a_new_type_settles(firmware, sensor_type, then, passes):
    talk = Conversation(firmware)
    talk.set(sensor_type, passes=500)
    assert talk.passes_until_valid(then) == passes


def test_firmware_1_05_goes_on_settling_with_the_same_pins():
    talk = Conversation("1.05")
    talk.set(SensorType.REFLECTION, passes=5)
    assert talk.passes_until_valid(SensorType.ANGLE) == 15


@pytest.mark.parametrize(("value", "valid", "byte"), [(0x01, True, 0x00), (0x02, False, 0x02), (0xFF, False, 0xFE)])
def test_the_firmware_owns_one_bit_of_the_validity(value, valid, byte):
    talk = Conversation()
    talk.set(SensorType.SWITCH)
    talk.put(InvalidData=value)
    assert talk.values().valid is valid
    assert talk.field("InvalidData") == byte


def test_without_a_color_sensor_the_port_stays_invalid():
    talk = Conversation()
    talk.set(SensorType.COLOR_FULL, passes=0)
    assert [talk.field("ColorCalibrationState") for _ in range(2)] == [1, 2]
    talk.put(InvalidData=0)
    talk.bench.control("!tick 1000")
    assert not talk.values().valid


def test_the_exit_of_a_missing_color_sensor_never_ends():
    talk = Conversation()
    talk.set(SensorType.COLOR_RED)
    talk.set(SensorType.NONE, passes=0)
    assert [talk.field("SensorType") for _ in range(4)] == [EXIT, 0, EXIT, 0]
    assert not talk.values().valid
    talk.hold(50, 2)
    assert {talk.values().type for _ in range(4)} == {EXIT}
    assert talk.passes_until_valid(SensorType.SWITCH) == 20


@pytest.mark.parametrize(("firmware", "sensor_type"), [("1.29", SensorType.COLOR_NONE), ("1.05", SensorType.COLOR_RED)])
def test_other_types_need_no_exit(firmware, sensor_type):
    talk = Conversation(firmware)
    talk.set(sensor_type)
    assert talk.passes_until_valid(SensorType.NONE) == 20


@pytest.mark.parametrize("firmware", ["1.29", "1.32"])
@pytest.mark.parametrize(
    ("old", "new", "raw", "clocks"),
    [(0, 18, 500, "0 0 0 0 0 0"), (0, 18, 20, "0 0 0 0 1 0"), (0, 13, 20, "0 0 0 0 1 0"), (13, 18, 20, "1 0 1 0 1 0"),
     (3, 18, 20, "0 0 1 0 1 0"), (18, 13, 20, "1 1 0 0 1 0"), (18, 18, 20, "1 0 0 0 0 0")],
)  # fmt: skip
def test_the_clock_of_a_colour_sensor_begins_with_its_types_and_their_end(firmware, old, new, raw, clocks):
    bench = Bench(SimBrick(firmware=firmware))
    bench.control("!i2c 0 attach 02")
    bench.control(f"!sensor 0 {raw}")
    bench.telegram(f"000500{old:02x}00")
    bench.control("!tick 50")
    seen = [bench.control("!i2c 0 log")]
    bench.telegram(f"000500{new:02x}00")
    for _ in range(5):
        seen.append(bench.control("!i2c 0 log"))
        bench.control("!tick 1")
    assert " ".join(line[-1] for line in seen) == clocks


def test_the_value_of_a_digital_type_follows_the_converter_in_1_32():
    bench = Bench(SimBrick(firmware="1.32"))
    bench.telegram("0005000b00")
    bench.control("!tick 30")
    bench.control("!sensor 0 50")
    bench.control("!tick 1")
    assert bench.telegram("0194010003000200" + "0200")[-4:] == "3200"


def test_a_reset_keeps_the_boolean():
    brick = SimBrick()
    brick.input.ports[0].boolean = 50
    brick.input.reset()
    assert brick.input.ports[0].boolean == 50


@pytest.mark.parametrize(("low_from", "passes", "valid_after"), [
    (0, 157, 400), (0, 158, 558), (0, 160, 558), (0, 400, 717), (50, 158, 400), (50, 159, 608), (300, 300, 400),
])  # fmt: skip
def test_the_calibration_of_what_looks_like_a_colour_sensor_fails_in_1_32(low_from, passes, valid_after):
    bench = Bench(SimBrick(firmware="1.32"))
    bench.control(f"!sensor 0 {700 if low_from else 34}")
    bench.telegram("0005001100")
    if low_from:
        bench.control(f"!tick {low_from - 1}")
        bench.control("!sensor 0 34")
    bench.control(f"!tick {passes}")
    bench.control("!sensor 0 700")
    waited = low_from + passes - bool(low_from)
    if waited < valid_after:
        bench.control(f"!tick {valid_after - 1 - waited}")
        assert bench.telegram("000700")[8:10] == "00"
    assert bench.telegram("000700")[8:10] == "01"


@pytest.mark.parametrize(("firmware", "types", "supplied"), [
    ("1.29", "03", "04"), ("1.29", "04", "04"), ("1.29", "05", "00"), ("1.29", "0b", "40"), ("1.29", "0b 0d", "00"),
    ("1.29", "0b 09", "00"), ("1.29", "0b 13", "40"), ("1.32", "03 13", "04"), ("1.05", "0b 13", "00"),
])  # fmt: skip
def test_some_types_have_the_battery_s_voltage(firmware, types, supplied):
    bench = Bench(SimBrick(firmware=firmware))
    for sensor_type in types.split():
        bench.telegram(f"000502{sensor_type}00")
    assert bench.control("!power") == f"power=00 display=1 inpower={supplied} div0=0"
