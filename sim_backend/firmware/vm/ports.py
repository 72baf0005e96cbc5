"""Instructions that read and write fields of ports."""

from __future__ import annotations

from collections.abc import Mapping

from sim_backend.firmware.vm.data import Place
from sim_backend.firmware.vm.machine import MANY, Instruction, Machine, Step, Translate
from sim_backend.firmware.vm.rxe import Type


def _get_input(machine: Machine, instruction: Instruction) -> Step:
    data, (target, port, field) = machine.data, instruction.arguments
    devices = machine.devices
    return machine.finished(lambda: data.put(target, devices.get_input(int(data.get(port)), field)), instruction)


def _set_input(machine: Machine, instruction: Instruction) -> Step:
    data, (source, port, field) = machine.data, instruction.arguments
    devices = machine.devices
    return machine.finished(lambda: devices.put_input(int(data.get(port)), field, int(data.get(source))), instruction)


def _get_output(machine: Machine, instruction: Instruction) -> Step:
    data, (target, port, field) = machine.data, instruction.arguments
    devices = machine.devices
    return machine.finished(lambda: data.put(target, devices.get_output(int(data.get(port)), field)), instruction)


def _set_output(machine: Machine, instruction: Instruction) -> Step:
    """Set several fields of one port, or of each port in an array."""
    ports, *pairs = machine.sized_arguments(instruction)
    data = machine.data

    def run() -> None:
        chosen = [Place(ports)]
        if data.kind(ports) == Type.ARRAY:
            chosen = data.parts(Place(ports))
        for place in chosen:
            port = int(data.get(place.entry, place.offset))
            for field, source in zip(pairs[::2], pairs[1::2], strict=False):
                machine.devices.put_output(port, field, int(data.get(source)))

    return machine.finished(run, instruction)


TABLE: Mapping[tuple[int, int], Translate] = {
    (0x30, 3): _set_input,
    (0x31, MANY): _set_output,
    (0x32, 3): _get_input,
    (0x33, 3): _get_output,
}
"""Opcode and number of arguments to the function that translates it."""
