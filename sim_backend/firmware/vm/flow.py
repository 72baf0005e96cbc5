"""Control flow: jumps, comparisons, clumps, mutexes, time."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any

from sim_backend.firmware.vm.machine import JUMP, NONE, Instruction, Machine, ProgramError, number
from sim_backend.firmware.vm.memory import Value

_COMPARISONS: tuple[Callable[[Any, Any], bool], ...] = (
    operator.lt,
    operator.gt,
    operator.le,
    operator.ge,
    operator.eq,
    operator.ne,
)


def compare(instruction: Instruction, left: Value, right: Value) -> bool:
    """Result of an instruction's comparison.

    Raises:
        ProgramError: Only one of the values is an array, or one of them has arrays inside and the other one numbers.
    """
    try:
        return bool(_COMPARISONS[instruction.flags](left, right))
    except TypeError:
        raise ProgramError("an array is compared with a number") from None


def _jump(machine: Machine, instruction: Instruction) -> None:
    machine.jump(instruction.arguments[0])


def _branch_if(machine: Machine, instruction: Instruction) -> None:
    offset, left, right = instruction.arguments
    if compare(instruction, machine.get(left), machine.get(right)):
        machine.jump(offset)


def _branch_test(machine: Machine, instruction: Instruction) -> None:
    offset, value = instruction.arguments
    if compare(instruction, machine.get(value), 0):
        machine.jump(offset)


def _stop(machine: Machine, instruction: Instruction) -> None:
    confirm = instruction.arguments[0]
    if confirm == NONE or machine.get(confirm):
        machine.stop()


def _finish(machine: Machine, instruction: Instruction) -> None:
    """End the clump and fire the given range of its dependents."""
    first, last = instruction.arguments
    machine.suspend(machine.task)
    if last != NONE:
        for dependent in machine.program.clumps[machine.task.number].dependents[first : last + 1]:
            machine.fire(dependent)


def _finish_into(machine: Machine, instruction: Instruction) -> None:
    machine.suspend(machine.task)
    machine.fire(instruction.arguments[0])


def _acquire(machine: Machine, instruction: Instruction) -> None:
    """Acquire a mutex, or sleep until it is free."""
    waiting = machine.mutexes.setdefault(instruction.arguments[0], [])
    if waiting:
        machine.suspend(machine.task)
    if machine.task.number not in waiting:
        waiting.append(machine.task.number)


def _release(machine: Machine, instruction: Instruction) -> None:
    waiting = machine.mutexes.get(instruction.arguments[0], [])
    if waiting and waiting[0] == machine.task.number:
        del waiting[0]
        if waiting:
            machine.resume(machine.tasks[waiting[0]])


def _call(machine: Machine, instruction: Instruction) -> None:
    """Run another clump, and continue when it returns."""
    clump, caller = instruction.arguments
    machine.put(caller, machine.task.number)
    machine.suspend(machine.task)
    machine.restart(machine.tasks[clump])


def _return(machine: Machine, instruction: Instruction) -> None:
    machine.suspend(machine.task)
    machine.resume(machine.tasks[number(machine.get(instruction.arguments[0]))])


def _wait(machine: Machine, instruction: Instruction) -> None:
    ended, duration = instruction.arguments
    duration_ms = number(machine.get(duration))
    if ended != NONE:
        machine.put(ended, machine.now_ms + duration_ms)
    machine.wait(duration_ms)


def _tick(machine: Machine, instruction: Instruction) -> None:
    machine.put(instruction.arguments[0], machine.now_ms)


TABLE: Mapping[int, Callable[[Machine, Instruction], None]] = {
    JUMP: _jump,
    0x26: _branch_if,
    0x27: _branch_test,
    0x29: _stop,
    0x2A: _finish,
    0x2B: _finish_into,
    0x2C: _acquire,
    0x2D: _release,
    0x2E: _call,
    0x2F: _return,
    0x34: _wait,
    0x35: _tick,
}
