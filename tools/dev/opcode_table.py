"""Print docs/protocol.md, made from the declarations: ``python -m tools.dev.opcode_table > docs/protocol.md``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from firmware_protocol.catalog import ALL_COMMANDS, AnyCommand, choices, describe
from firmware_protocol.iomap import IO_MAPS
from firmware_protocol.iomap_layout import Array, Field, IOMap
from firmware_protocol.layout import Layout
from firmware_protocol.status import Status
from firmware_protocol.telegram import Kind
from firmware_protocol.wire import Number

from .program import parser

INTRODUCTION = """\
# The protocol as nxtdrive declares it

`tools/dev/opcode_table.py` generates this file from the declarations in `firmware_protocol/`; change those, then run
`python -m tools.dev.opcode_table > docs/protocol.md`. How the firmware handles each command is in
[firmware.md](firmware.md), sections 2 to 6.

A request is its kind (`00` direct, `01` system, plus `80` if no reply is wanted), its opcode and its fields; a reply is
`02`, the opcode, a status byte and its fields. Integers are little-endian: `u16` is unsigned with 16 bits, `s8` signed
with 8. Text is Latin-1, padded with zeros. The leading fields of a reply that have the name of a
request's field repeat its value. Commands marked † came with firmware 1.28; those marked ‡ exist only in the
community's firmware 1.32."""

_MARKS = {"1.05": "", "1.28": " †", "1.32": " ‡"}


def document() -> str:
    """Return the text of docs/protocol.md."""
    parts = [
        INTRODUCTION,
        "## Direct commands",
        *_command_table(Kind.DIRECT),
        "## System commands",
        *_command_table(Kind.SYSTEM),
        "## Named values",
        *_named_values(),
        "## Status bytes",
        _table(("status", "meaning", "what to do"), _status_rows()),
        "## IO maps",
        "Offsets are bytes from the map's beginning; `0 + 32 i` is a variable that exists once for each motor, port, "
        "button or line.",
        *_io_maps(),
    ]
    return "\n\n".join(parts) + "\n"


def _command_table(kind: Kind) -> Iterator[str]:
    rows = [_command_row(command) for command in ALL_COMMANDS if command.kind == kind]
    yield _table(("opcode", "command", "request", "reply", "what it does"), rows)


def _command_row(command: AnyCommand) -> tuple[str, ...]:
    mark = _MARKS[command.since]
    doc = " ".join((command.__doc__ or "").split("\n\n")[0].split())
    reply = _fields(command.reply_type.layout)
    return f"`{command.opcode:02X}`", f"{command.__name__}{mark}", _fields(command.layout), reply, doc


def _fields(layout: Layout) -> str:
    return ", ".join(f"{name} *{describe(wire, layout.units[name])}*" for name, wire in layout.wires.items()) or "–"


def _named_values() -> Iterator[str]:
    seen: dict[str, str] = {}
    for command in ALL_COMMANDS:
        for wire in (*command.layout.wires.values(), *command.reply_type.layout.wires.values()):
            if isinstance(wire, Number) and isinstance(wire.members.enum, type):
                values = ", ".join(f"`{value:02X}` {name}" for name, value in choices(wire).items())
                seen[describe(wire)] = values
    yield _table(("type", "values"), seen.items())


def _status_rows() -> Iterator[tuple[str, ...]]:
    for name, status in Status.__members__.items():
        yield f"`{status:02X}`", name, status.remedy


def _io_maps() -> Iterator[str]:
    for io_map in IO_MAPS.values():
        yield _map_heading(io_map)
        yield _table(("offset", "field", "type"), (_map_row(name, field) for name, field in io_map.fields.items()))


def _map_heading(io_map: IOMap) -> str:
    older = f" ({io_map.size_1_05} in firmware 1.05)" if io_map.size_1_05 != io_map.size else ""
    return f"### {io_map.name}: 0x{io_map.module_id:08X}, {io_map.size} bytes{older}"


def _map_row(name: str, field: Field) -> tuple[str, ...]:
    several = f" + {field.stride} i, i < {field.copies}" if field.copies > 1 else ""
    wire = field.wire
    kind = f"{wire.length} x {describe(wire.scalar)}" if isinstance(wire, Array) else describe(wire)
    return f"{field.offset}{several}", name, kind


def _table(heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [heads, tuple("---" for _ in heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    parser(__doc__).parse_args()
    print(document(), end="")
