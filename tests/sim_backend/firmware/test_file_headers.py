"""Places of files and their headers in the flash; the expected ones are those of LEGO's firmware."""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.files.file_header import FIXED_SIZE, File, Kind, fixed_header
from sim_backend.firmware.files.flash_memory import address_of

LIST = "01862a2e2a0000000000000000000000000000000000"
NEXT = "018700"


def named(opcode: str, name: str) -> str:
    """A telegram with a name."""
    return f"01{opcode}{name.encode().ljust(20, bytes(1)).hex()}"


def created(opcode: str, name: str, size: int) -> str:
    """A telegram that creates a file."""
    return named(opcode, name) + size.to_bytes(4, "little").hex()


def written(handle: int, size: int) -> list[str]:
    """Telegrams that write `size` bytes."""
    return [f"0183{handle:02x}{'5a' * min(50, size - start)}" for start in range(0, size, 50)]


def complete(name: str, size: int) -> list[str]:
    """A whole download by handle 0."""
    return [created("81", name, size), *written(0, size), "018400"]


def filled(sectors: int) -> list[str]:
    """Three files that take a sector more each than is counted, and one that takes `sectors`."""
    size = 254 * sectors - 38
    three = [line for name in "uvw" for line in complete(name, 473)]
    return [*three, created("8b", "big", size), "018400"]


ABORTED = [created("81", "x", 1), "018401"]
"""Frees the sectors of the download by handle 0, too: the next file overlaps it."""

FIVE = [line for number in range(5) for line in complete(f"p{number}.t", 5)]


def last_reply(firmware: str, lines: list[str]) -> str:
    bench = Bench(SimBrick(firmware=firmware))
    for line in lines:
        got = bench.answer(line)
    return got


def name_of(reply: str) -> str:
    return bytes.fromhex(reply)[4:24].rstrip(b"\0").decode()


@pytest.mark.parametrize(("firmware", "name"), [("1.29", "p2.t"), ("1.05", "p3.t")])
def test_the_handle_that_deleted_a_file_goes_on_behind_it(firmware, name):
    assert name_of(last_reply(firmware, [*FIVE, named("85", "*.t"), NEXT])) == name


@pytest.mark.parametrize(
    ("firmware", "sectors", "opcode", "status"),
    [
        ("1.29", 467, "81", "8a00"),
        ("1.29", 467, "89", "8900"),
        ("1.29", 467, "8b", "8a00"),
        ("1.05", 481, "81", "8a00"),
        ("1.05", 481, "89", "8900"),
        ("1.05", 481, "8b", "8900"),
        ("1.29", 466, "81", "0000"),
        ("1.05", 480, "81", "0000"),
    ],
)
def test_a_file_may_lack_sectors_but_not_all(firmware, sectors, opcode, status):
    assert last_reply(firmware, [*filled(sectors), created(opcode, "z", 300)]) == f"02{opcode}{status}"


@pytest.mark.parametrize("firmware", ["1.29", "1.05"])
@pytest.mark.parametrize(
    ("size", "count", "name"),
    [
        (100, 99, "b"),
        (100, 100, "a"),
        (300, 215, "b"),
        (300, 216, "a"),
        (20000, 63, "b"),
        (20000, 64, "a"),
        (60000, 300, "b"),
    ],
)
def test_the_header_is_written_again_with_the_rest_of_its_sector(firmware, size, count, name):
    overlapping = [created("81", "a", size), *ABORTED, created("81", "b", 1), "0183015a", "018401"]
    assert name_of(last_reply(firmware, [*overlapping, *written(0, count), LIST])) == name


@pytest.mark.parametrize("firmware", ["1.29", "1.05"])
@pytest.mark.parametrize(("size", "count", "name"), [(300, 0, "a"), (300, 215, "a"), (300, 216, "d"), (60000, 0, "d")])
def test_the_end_of_a_data_file_writes_it_again_if_that_sector_is_not_full(firmware, size, count, name):
    overlapping = [created("81", "d", 1), *ABORTED, created("8b", "a", size), *written(1, count)]
    assert name_of(last_reply(firmware, [*overlapping, "0183005a", "018401", LIST])) == name


def test_every_creation_writes_the_header():
    overlapping = [created("81", "d", 1), *ABORTED, "0183005a", "018400", created("81", "e", 60000)]
    assert name_of(last_reply("1.29", [*overlapping, LIST])) == "e"


@pytest.mark.parametrize("action", ["read", "seek", "append"])
def test_a_header_of_gigabytes_is_followed_as_far_as_the_flash_has_room(action):
    brick = SimBrick()
    memory, loader = brick.loader.flash.memory, brick.loader
    address = address_of(memory.sectors[100])
    huge = fixed_header("h.txt", address + FIXED_SIZE, 0xFFFF_FFFF, Kind.DATA)
    memory.write(address, huge)
    file = File(memory, address)
    file.set_data_size(0xFFFF_FF00)
    loader.flash.directory.insert(0, address)
    reads, read = 0, memory.read

    def counted(place, size):
        nonlocal reads
        reads += 1
        return read(place, size)

    memory.read = counted
    if action == "append":
        loader.append("h.txt")
    elif action == "seek":
        loader.opened(loader.open_read("h.txt").handle).seek(0xF000_0000, file)
    else:
        loader.read(loader.open_read("h.txt").handle, 0xFFFF_FFFF)
    assert reads < 2000
