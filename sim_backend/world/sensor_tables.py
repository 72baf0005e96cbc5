"""Tables of a world file for sensors: what they measure, and the sensors on the robot."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from sim_backend.world.toml_types import (
    Direction,
    Entries,
    Length,
    Mounting,
    Offset,
    Paint,
    Point,
    Positive,
    Seconds,
    Size,
    Table,
)

Port = Annotated[int, Field(ge=1, le=4)]
Byte = Annotated[int, Field(ge=0, le=255)]


class Patch(Table):
    """A patch of colour on the floor: a rectangle, or tape along a line. Later patches cover earlier ones.

    Attributes:
        color: A name, or reflected [red, green, blue] light in percent.
        at_mm: Centre of the rectangle.
        size_mm: Depth along the facing, and width, of the rectangle.
        facing_deg: Direction of the depth.
        along_mm: Corners of the tape's line.
        width_mm: Width of the tape.
    """

    color: Paint
    at_mm: Point | None = None
    size_mm: Size | None = None
    facing_deg: Direction = 0.0
    along_mm: Entries[Point] = ()
    width_mm: Length = 20.0

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.at_mm is not None) == bool(self.along_mm):
            raise ValueError("needs exactly one of at_mm (a rectangle) and along_mm (tape)")
        if (self.at_mm is None) != (self.size_mm is None):
            raise ValueError("at_mm and size_mm belong together")
        if len(self.along_mm) == 1:
            raise ValueError("along_mm needs two points or more")
        return self


class Surroundings(Table):
    """Conditions that are the same everywhere in the room.

    Attributes:
        sound_db: Background noise.
        temperature_c: Temperature, degrees Celsius.
        north_deg: Direction of a compass needle on the map; 270 is up.
    """

    sound_db: Annotated[float, Field(ge=0, le=130)] = 50.0
    temperature_c: Annotated[float, Field(ge=-40, le=125)] = 21.0
    north_deg: Direction = 270.0


class Sound(Table):
    """A source of sound; the level falls by 6 dB per doubling of the distance.

    Attributes:
        at_mm: Position.
        level_db: Sound level at 1 m.
        from_s: Start time.
        for_s: Duration; unlimited if omitted.
    """

    at_mm: Point
    level_db: Annotated[float, Field(ge=0, le=130)]
    from_s: Seconds = 0.0
    for_s: Positive | None = None


class Magnet(Table):
    """Iron or a magnet that deflects a compass nearby.

    Attributes:
        at_mm: Position.
        radius_mm: Range.
        deflection_deg: Deflection at the position, clockwise; it falls linearly to zero at the range.
    """

    at_mm: Point
    radius_mm: Length
    deflection_deg: Annotated[float, Field(ge=-180, le=180)]


class EchoSettings(Table):
    """Parameters of an ultrasonic sensor.

    Attributes:
        height_mm: Height of the sensor; lower objects give no echo.
        noise_mm: Standard deviation of a reading.
        dropout: Share of readings that randomly miss the echo, 0..1.
        max_incidence_deg: Flat surfaces hit at a larger angle from their normal deflect the echo; 90 keeps all.
    """

    height_mm: Length = 90.0
    noise_mm: Annotated[float, Field(ge=0, le=1000)] = 5.0
    dropout: Annotated[float, Field(ge=0, le=1)] = 0.0
    max_incidence_deg: Annotated[float, Field(gt=0, le=90)] = 65.0


class Ultrasonic(EchoSettings):
    """The ultrasonic sensor at the robot's front.

    Attributes:
        forward_mm: Distance in front of the axle.
    """

    forward_mm: Offset = 100.0


class TouchMount(Table):
    """A bumper.

    Attributes:
        port: Input port.
        direction_deg: Direction of its middle, clockwise from the front.
        width_deg: Covered angle.
    """

    kind: Literal["touch"] = "touch"
    port: Port
    direction_deg: Direction = 0.0
    width_deg: Annotated[float, Field(gt=0, le=360)] = 90.0


class LightMount(Table):
    """The light sensor; the type set on the brick switches its lamp.

    Attributes:
        port: Input port.
        at_mm: Position on the robot: (forward, right) of the middle of the axle.
        looks: Down at the floor, or ahead into the room.
        noise_percent: Standard deviation of a reading.
    """

    kind: Literal["light"]
    port: Port
    at_mm: Mounting = (80.0, 0.0)
    looks: Literal["down", "ahead"] = "down"
    noise_percent: Annotated[float, Field(ge=0, le=50)] = 0.5


class ColorMount(Table):
    """The colour sensor, directed at the floor below it.

    Attributes:
        port: Input port.
        at_mm: Position on the robot: (forward, right) of the middle of the axle.
        noise_percent: Standard deviation of the reading of each lamp.
    """

    kind: Literal["color"]
    port: Port
    at_mm: Mounting = (80.0, 0.0)
    noise_percent: Annotated[float, Field(ge=0, le=50)] = 0.5


class SoundMount(Table):
    """The sound sensor.

    Attributes:
        port: Input port.
        noise_db: Standard deviation of a reading.
    """

    kind: Literal["sound"]
    port: Port
    noise_db: Annotated[float, Field(ge=0, le=30)] = 0.5


class UltrasonicMount(EchoSettings):
    """An additional ultrasonic sensor.

    Attributes:
        port: Input port.
        at_mm: Position on the robot: (forward, right) of the middle of the axle.
        direction_deg: Direction of the beam, clockwise from the front.
    """

    kind: Literal["ultrasonic"]
    port: Port
    at_mm: Mounting = (0.0, 0.0)
    direction_deg: Direction = 0.0


class TemperatureMount(Table):
    """A temperature sensor.

    Attributes:
        port: Input port.
        model: "nxt" is the digital one (9749), "rcx" the analog one of the RCX (9889).
    """

    kind: Literal["temperature"]
    port: Port
    model: Literal["nxt", "rcx"] = "nxt"


class CompassMount(Table):
    """HiTechnic's compass.

    Attributes:
        port: Input port.
        noise_deg: Standard deviation of a reading.
    """

    kind: Literal["compass"]
    port: Port
    noise_deg: Annotated[float, Field(ge=0, le=90)] = 1.0


def _registers(values: dict[str, str | tuple[int, ...]]) -> dict[str, str | tuple[int, ...]]:
    for name, value in values.items():
        if isinstance(value, str) and not value.isascii():
            raise ValueError(f"the text at {name} is not ASCII; give it as bytes")
        number = int(name, 0) if name.isdecimal() or name.lower().startswith("0x") else -1
        if not 0 <= number <= 255:
            raise ValueError(f'{name!r} is not a register; give 0 to 255, or "0x42"')
        if number + len(value) > 256:
            raise ValueError(f"the values at {name} go beyond register 255")
    return values


class I2CMount(Table):
    """Any digital sensor, as 256 readable and writable registers.

    Attributes:
        port: Input port.
        address: Address in the 8-bit write form.
        registers: Initial values: number of the first register to a text or a list of bytes.
    """

    kind: Literal["i2c"]
    port: Port
    address: Annotated[int, Field(ge=2, le=254, multiple_of=2)] = 0x02
    registers: Annotated[dict[str, str | Entries[Byte]], AfterValidator(_registers)] = Field(default_factory=dict)


Mount = Annotated[
    TouchMount | LightMount | ColorMount | SoundMount | UltrasonicMount | TemperatureMount | CompassMount | I2CMount,
    Field(discriminator="kind"),
]
"""A sensor on the robot."""
