"""Control flow: jumps, clumps, mutexes, time. Source: docs/firmware.md section 8.3."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sim_backend.firmware.cint import s16
from sim_backend.firmware.vm.aggregates import HOLD_FOR_EQUALS, compare
from sim_backend.firmware.vm.arithmetic import as_signed, related, whole_comparison
from sim_backend.firmware.vm.clump_queue import NO_CLUMP, ClumpQueue
from sim_backend.firmware.vm.data import NONE, Place, ProgramError
from sim_backend.firmware.vm.instructions import (
    END_TURN,
    Branch,
    Effect,
    Instruction,
    Next,
    Ports,
    Step,
    Translation,
)
from sim_backend.firmware.vm.machine import QUEUE_CHANGED, Machine, Translate
from sim_backend.firmware.vm.rxe import Type

_SHORT_CALL = 2
"""Words of the short form of CALL."""


def _target(machine: Machine, instruction: Instruction) -> int:
    """Return the target of a jump; outside of the code, the end of the code, which is an error when reached."""
    target, end = instruction.at + s16(instruction.arguments[0]), len(machine.program.code)
    return target if 0 <= target < end else end


def _jump(machine: Machine, instruction: Instruction) -> Next:
    return Next(_target(machine, instruction))


def _branch_if(machine: Machine, instruction: Instruction) -> Translation:
    _, left, right = instruction.arguments
    target, following, relation = _target(machine, instruction), instruction.following, instruction.flags
    if machine.task.misses:
        return Next(_wrong_jump(machine, instruction))
    if machine.operands.scalars(left, right):
        cells = machine.operands.cells((left, right))
        return Branch(whole_comparison(machine, relation, left, right), target, following, cells)
    data, first, second = machine.data, Place(left), Place(right)
    accepts = machine.dialect.accepts_mixed_comparisons and relation in HOLD_FOR_EQUALS

    def run() -> int:
        try:
            return target if compare(data, relation, first, second) else following
        except ProgramError:
            if accepts:
                return target
            raise

    return Next(run)


def _wrong_jump(machine: Machine, instruction: Instruction) -> Step:
    """Return a conditional jump that, if not made, leads as far from its target as the turn began from the clump.

    The distance of the target then counts without a sign.
    """
    relation, end, distance = instruction.flags, len(machine.program.code), instruction.arguments[0]
    left, right = (Place(argument) for argument in instruction.arguments[1:])

    def run() -> int:
        start = machine.program.clumps[machine.task.number].start
        holds = compare(machine.data, relation, left, right)
        word = instruction.at + (s16(distance) if holds else distance - (machine.turn_start - start))
        return word if word >= 0 else end

    return run


def _branch_test(machine: Machine, instruction: Instruction) -> Branch:
    operands, tested = machine.operands, instruction.arguments[1]
    value = operands.integer(tested)
    if machine.data.kind(tested) in (Type.ULONG, Type.FLOAT):  # taken as a number with a sign
        value = as_signed(value)
    condition = related(value, instruction.flags, "0")
    return Branch(condition, _target(machine, instruction), instruction.following, operands.cells([tested]))


def _stop(machine: Machine, instruction: Instruction) -> Next:
    confirm, following = instruction.arguments[0], instruction.following

    def run() -> int:
        if confirm == NONE or machine.data.integer(confirm):
            if machine.dialect.runs_past_end:
                machine.task.pc = following  # others show where the turn began
            machine.stop()
            return END_TURN
        return following

    return Next(run)


def _finish(machine: Machine, instruction: Instruction) -> Next:
    """End the clump and fire the given range of its dependents; the firmware does not check the count.

    Those of a clump without dependents are at address 0, which is assumed to have zeros.
    """
    first, last = instruction.arguments
    content = machine.program.content

    def run() -> int:
        clump = machine.program.clumps[machine.task.number]
        machine.suspend(0)
        if last != NONE:
            begin, end = (max(clump.list_at + s16(number), 0) for number in (first, last + 1))
            fired = content[begin:end] if clump.dependents else bytes(max(end - begin, 0))
            machine.memory.spend(len(fired))
            for dependent in fired:
                machine.fire(dependent)
        machine.reset(machine.task)
        return END_TURN

    return Next(run)


def _finish_into(machine: Machine, instruction: Instruction) -> Next:
    """End the clump and fire the given one."""

    def run() -> int:
        machine.suspend(0)
        machine.fire(instruction.arguments[0])
        machine.reset(machine.task)
        return END_TURN

    return Next(run)


def _acquire(machine: Machine, instruction: Instruction) -> Next:
    """Acquire a mutex, or wait until it is free; its variable has the bytes owner, first and last waiting clump."""
    mutex, data, following = instruction.arguments[0], machine.data, instruction.following
    pool, base = machine.memory.pool, machine.memory.base

    def run() -> int:
        at = data.entry(mutex).data
        owner, number = base + at, machine.queue.first
        if pool[owner] == NO_CLUMP:
            pool[owner] = number
            return following
        machine.suspend(following)
        _waiting(machine, at).append(number)
        return END_TURN

    return Next(run)


def _release(machine: Machine, instruction: Instruction) -> Next:
    """Give a mutex to the first clump that waits for it."""
    mutex, data, following = instruction.arguments[0], machine.data, instruction.following

    def run() -> int:
        return QUEUE_CHANGED - following if _hand_over(machine, data.entry(mutex).data) else following

    return Next(run)


def _hand_over(machine: Machine, mutex: int) -> bool:
    """Give a mutex to the first clump that waits for it; return whether there is one."""
    waiting, memory = _waiting(machine, mutex), machine.memory
    memory.pool[memory.base + mutex] = number = waiting.first
    if number == NO_CLUMP:
        return False
    waiting.remove(number)
    machine.queue.append(number)
    return True


def start_clump(machine: Machine, number: int, following: int) -> int:
    """Start a clump, unless it runs, sleeps, or waits for a mutex; then the turn of the current one begins again."""
    waits = any(number in _waiting(machine, mutex) for mutex in _mutexes(machine))
    return following if waits else machine.start(number, following)


def end_clump(machine: Machine, number: int) -> None:
    """End a clump wherever it is, after its mutexes have been given to the clumps that wait for them."""
    memory, mutexes = machine.memory, _mutexes(machine)
    for mutex in mutexes:
        if memory.pool[memory.base + mutex] == number:
            _hand_over(machine, mutex)
    machine.halt(number, [_waiting(machine, mutex) for mutex in mutexes])


def _mutexes(machine: Machine) -> list[int]:
    table = machine.data.variables[: machine.program.header.variables]
    return [entry.data for entry in table if entry.type == Type.MUTEX]


def _waiting(machine: Machine, mutex: int) -> ClumpQueue:
    """Return the queue of a mutex, after its owner."""
    return machine.queue_at(machine.memory.pool, machine.memory.base + mutex + 1)


def _call(machine: Machine, instruction: Instruction) -> Next:
    """Run another clump, and continue when it returns; a clump that calls itself continues."""
    clump, caller = instruction.arguments
    place = _caller_place(machine, caller)
    short = instruction.following - instruction.at == _SHORT_CALL

    def run() -> int:
        machine.memory.store(Type.UBYTE, place(), machine.queue.first)
        if not short:
            machine.note_call(machine.queue.first, clump & 0xFF)
        machine.suspend(instruction.following)
        machine.queue.append(clump & 0xFF)
        return END_TURN

    return Next(run)


def _return(machine: Machine, instruction: Instruction) -> Next:
    """Continue the caller; without a variable, the clump in the first byte of the variables."""
    place = _caller_place(machine, instruction.arguments[0])

    def run() -> int:
        number = int(machine.memory.load(Type.UBYTE, place()))
        machine.suspend(0)
        machine.note_call(number, NO_CLUMP)
        machine.queue.append(number)
        machine.reset(machine.task)
        return END_TURN

    return Next(run)


def _caller_place(machine: Machine, argument: int) -> Callable[[], int]:
    """Return a function that gives the place of a clump's number: the first byte of a variable of any type.

    In firmware 1.05 that of a cluster is in its first member, that of an array in its elements.
    """
    data, memory = machine.data, machine.memory
    if machine.dialect.has_fields:
        while data.kind(argument) == Type.CLUSTER:
            argument += 1
    at = data.place_of(argument)
    if machine.dialect.has_fields and data.kind(argument) == Type.ARRAY:
        return lambda: memory.array(memory.index(at)).offset
    return lambda: at


def _wait(machine: Machine, instruction: Instruction) -> Next:
    *begun, duration = instruction.arguments
    data, following = machine.data, instruction.following

    def run() -> int:
        duration_ms = data.integer_or(duration, 0)
        if begun and begun[0] != NONE:
            data.put(begun[0], machine.tick)
        return machine.sleep(duration_ms, following)

    return Next(run)


def _tick(machine: Machine, instruction: Instruction) -> Translation:
    operands, target = machine.operands, instruction.arguments[0]
    statement = operands.assignment(target, f"{operands.function('now', machine.read_clock)}()")
    if statement:
        return Effect((statement,), Ports.NOTHING, reads_clock=True)
    return lambda: machine.data.put(target, machine.read_clock())


TABLE: Mapping[tuple[int, int], Translate] = {
    (0x25, 1): _jump,
    (0x26, 3): _branch_if,
    (0x27, 2): _branch_test,
    (0x29, 1): _stop,
    (0x2A, 2): _finish,
    (0x2B, 1): _finish_into,
    (0x2C, 1): _acquire,
    (0x2D, 1): _release,
    (0x2E, 2): _call,
    (0x2F, 1): _return,
    (0x34, 2): _wait,
    (0x35, 1): _tick,
}
"""Opcode and number of arguments, `MANY` for more, to the function that translates it."""
