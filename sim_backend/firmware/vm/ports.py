"""Instructions that read and write fields of ports. Source: docs/firmware.md sections 8.2 and 8.4."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from sim_backend.firmware.vm.data import ERR_INSTR, Place, ProgramError
from sim_backend.firmware.vm.devices import ACTING, OUTPUT_FIELDS, stored_output
from sim_backend.firmware.vm.instructions import MANY, Effect, Instruction, Ports, Translation, sized_arguments
from sim_backend.firmware.vm.machine import Machine, Translate
from sim_backend.firmware.vm.rxe import Type

_PORTS = 3


def _read(machine: Machine, instruction: Instruction, reader: Callable[[int], Callable[[int], int]]) -> Translation:
    data, operands, (target, port, field) = machine.data, machine.operands, instruction.arguments
    read = reader(field)
    name = operands.function(f"{reader.__name__}_{field}", read)
    statement = operands.assignment(target, f"{name}({operands.integer(port)})")
    if statement:
        return Effect((statement,), Ports.READS)
    return lambda: data.put(target, read(data.integer(port)))


def _get_input(machine: Machine, instruction: Instruction) -> Translation:
    return _read(machine, instruction, machine.devices.input_reader)


def _get_output(machine: Machine, instruction: Instruction) -> Translation:
    return _read(machine, instruction, machine.devices.output_reader)


def _set_input(machine: Machine, instruction: Instruction) -> Translation:
    data, (source, port, field) = machine.data, instruction.arguments
    devices = machine.devices
    return lambda: devices.put_input(data.integer(port), field, data.integer(source))


def _set_output(machine: Machine, instruction: Instruction) -> Translation:
    """Set several fields of one port, or of each port in an array.

    Raises:
        ProgramError: It has the size of an instruction with three arguments, and the firmware is 1.05.
    """
    if instruction.form < MANY:
        if machine.dialect.has_fields:
            raise ProgramError(ERR_INSTR, "outputs are set by an instruction of eight bytes")
        return Effect((), Ports.NOTHING)
    ports, *pairs = sized_arguments(machine.program.code, instruction, more=1)  # the value of an incomplete pair
    data, operands, put = machine.data, machine.operands, machine.devices.put_output
    values = list(zip(pairs[::2], pairs[1::2], strict=False))
    if values and operands.scalars(ports) and all(field < len(OUTPUT_FIELDS) for field, _ in values):
        return _fast_setting(machine, ports, values)

    fields = len(machine.devices.output_fields)

    def run() -> None:
        if data.kind(ports) == Type.ARRAY:
            chosen: Iterable[int] = (data.integer(place.entry, place.offset) for place in data.parts(Place(ports)))
        else:
            number = data.integer(ports)
            chosen = machine.dialect.port_groups.get(number, (number,))
        for port in chosen:
            for field, source in values:
                if 0 <= port < _PORTS <= port + field / fields:
                    raise ProgramError(ERR_INSTR, f"there is no field {field}")
                put(port, field, data.integer(source))

    return run


def _fast_setting(machine: Machine, port: int, values: Sequence[tuple[int, int]]) -> Effect:
    """Set fields, each of which exists, of the port that a number names."""
    operands, module = machine.operands, machine.devices.output
    operands.names["outputs"] = module.outputs
    operands.names["groups"] = {number: (number,) for number in range(_PORTS)} | dict(machine.dialect.port_groups)
    wake = operands.function("wake_outputs", module.wake)
    lines = [f"for number in groups.get({operands.integer(port)}, ()):", "    port = outputs[number]"]
    for field, value in values:
        name = OUTPUT_FIELDS[field]
        lines.append(f"    port.{name} = {stored_output(name, operands.integer(value))}")
    if any(OUTPUT_FIELDS[field] in ACTING for field, _ in values):
        lines.append(f"    {wake}()")
    return Effect(tuple(lines), None if machine.dialect.has_fields else Ports.SETS)


TABLE: Mapping[tuple[int, int], Translate] = {
    (0x30, 3): _set_input,
    **{(0x31, count): _set_output for count in (3, MANY)},
    (0x32, 3): _get_input,
    (0x33, 3): _get_output,
}
"""Opcode and number of arguments to the function that translates it."""
