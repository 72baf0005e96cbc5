"""Instructions that read and write fields of ports."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sim_backend.firmware.vm.data import ERR_ARG, NONE, Place, ProgramError
from sim_backend.firmware.vm.devices import OUTPUT_FIELDS
from sim_backend.firmware.vm.instructions import MANY, Effect, Instruction, Translation, sized_arguments
from sim_backend.firmware.vm.machine import Machine, Translate
from sim_backend.firmware.vm.rxe import Type

_PORTS = 3


def _read(machine: Machine, instruction: Instruction, get: Callable[[int, int], int]) -> Translation:
    data, operands, (target, port, field) = machine.data, machine.operands, instruction.arguments
    name = operands.function(get.__name__, get)
    statement = operands.assignment(target, f"{name}({operands.integer(port)}, {field})")
    return statement or (lambda: data.put(target, get(data.integer(port), field)))


def _get_input(machine: Machine, instruction: Instruction) -> Translation:
    return _read(machine, instruction, machine.devices.get_input)


def _get_output(machine: Machine, instruction: Instruction) -> Translation:
    return _read(machine, instruction, machine.devices.get_output)


def _set_input(machine: Machine, instruction: Instruction) -> Translation:
    data, (source, port, field) = machine.data, instruction.arguments
    devices = machine.devices
    return lambda: devices.put_input(data.integer(port), field, data.integer(source))


def _set_output(machine: Machine, instruction: Instruction) -> Translation:
    """Set several fields of one port, or of each port in an array."""
    ports, *pairs = sized_arguments(machine.program.code, instruction) or (NONE,)
    data, operands, put = machine.data, machine.operands, machine.devices.put_output
    values = list(zip(pairs[::2], pairs[1::2], strict=False))
    if operands.scalars(ports) and all(field < len(OUTPUT_FIELDS) for field, _ in values):
        name, port = operands.function("put_output", put), operands.integer(ports)
        return Effect(tuple(f"{name}({port}, {field}, {operands.integer(value)})" for field, value in values))

    def run() -> None:
        places = data.parts(Place(ports)) if data.kind(ports) == Type.ARRAY else [Place(ports)]
        for place in places:
            port = data.integer(place.entry, place.offset)
            for field, source in values:
                if 0 <= port < _PORTS <= port + field / len(OUTPUT_FIELDS):
                    raise ProgramError(ERR_ARG, f"there is no field {field}")
                put(port, field, data.integer(source))

    return run


TABLE: Mapping[tuple[int, int], Translate] = {
    (0x30, 3): _set_input,
    **{(0x31, count): _set_output for count in (3, MANY)},
    (0x32, 3): _get_input,
    (0x33, 3): _get_output,
}
"""Opcode and number of arguments to the function that translates it."""
