"""What the community's firmware 1.32 answers differently: docs/firmware.md section 11."""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick


def answers(firmware: str, *lines: str) -> list[str]:
    """Replies to telegrams in hex and to control lines (docs/firmware.md section 0.1)."""
    bench = Bench(SimBrick(firmware=firmware))
    return [bench.control(line) if line.startswith("!") else bench.telegram(line) for line in lines]


@pytest.mark.parametrize(("firmware", "reply"), [("1.29", "0288007c011d01"), ("1.32", "0288007c012001")])
def test_it_reports_its_own_version(firmware, reply):
    assert answers(firmware, "0188") == [reply]


@pytest.mark.parametrize(("firmware", "free"), [("1.29", 120_868), ("1.32", 103_852)])
def test_it_has_less_flash_for_files(firmware, free):
    assert answers(firmware, "019b")[0][-8:] == free.to_bytes(4, "little").hex()


@pytest.mark.parametrize(
    ("name", "size"),
    [("Comm.mod", 1900), ("Input.mod", 420), ("Low Speed.mod", 172), ("Output.mod", 100), ("Ui.mod", 44)],
)
def test_its_maps_are_longer(name, size):
    (reply,) = answers("1.32", "0190" + name.encode().ljust(20, b"\0").hex())
    assert reply[-4:] == size.to_bytes(2, "little").hex()


def test_its_motors_have_speed_limits_and_a_common_period():
    assert answers("1.32", "0194010002001e000200", "01940100020060000100") == [
        "0294000100020002005014",
        "02940001000200010064",
    ]


def test_a_written_byte_beyond_the_map_of_1_29_is_kept():
    assert answers("1.32", "019501000c002800010007", "019401000c0028000100")[1] == "02940001000c00010007"
