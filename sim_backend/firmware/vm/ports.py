"""Instructions that read and write fields of ports."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sim_backend.firmware.vm.machine import Instruction, Machine, number


def _get_input(machine: Machine, instruction: Instruction) -> None:
    target, port, field = instruction.arguments
    machine.put(target, machine.devices.get_input(number(machine.get(port)), field))


def _set_input(machine: Machine, instruction: Instruction) -> None:
    source, port, field = instruction.arguments
    machine.devices.put_input(number(machine.get(port)), field, number(machine.get(source)))


def _get_output(machine: Machine, instruction: Instruction) -> None:
    target, port, field = instruction.arguments
    machine.put(target, machine.devices.get_output(number(machine.get(port)), field))


def _set_output(machine: Machine, instruction: Instruction) -> None:
    """Set several fields of one port, or of each port in an array."""
    ports, *pairs = instruction.arguments
    chosen = machine.get(ports)
    for port in chosen if isinstance(chosen, list) else [chosen]:
        for field, source in zip(pairs[::2], pairs[1::2], strict=False):
            machine.devices.put_output(number(port), field, number(machine.get(source)))


TABLE: Mapping[int, Callable[[Machine, Instruction], None]] = {
    0x30: _set_input,
    0x31: _set_output,
    0x32: _get_input,
    0x33: _get_output,
}
