"""The display, written by telegrams and read back as a picture."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from firmware_protocol.errors import RemoteProtocolError
from firmware_protocol.framing import BLUETOOTH_TELEGRAM_LIMIT
from firmware_protocol.iomap import DISPLAY, DisplayFlag
from firmware_protocol.system import IOMapWrite
from nxtdrive.brick import Brick
from nxtdrive.cli.commands.screenshot import GLASS, INK
from nxtdrive.cli.main import USAGE, main
from nxtdrive.onboard.display import read_display
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation

WRITE_LIMIT = 54
"""Over USB. Source: docs/firmware.md section 2."""


@pytest.fixture(scope="module")
def simulation():
    return Simulation("open")


@pytest.fixture(scope="module")
def brick(simulation):
    with Brick(SimTransport(simulation)) as brick:
        yield brick


def draw(brick, image, buffer="Normal"):
    """Write a picture into the framebuffer, a line of 8 rows after the other."""
    lines = np.packbits(image.reshape(8, 8, 100), axis=1, bitorder="little").tobytes()
    start = DISPLAY.field(buffer).offset
    for offset in range(0, len(lines), WRITE_LIMIT):
        portion = lines[offset : offset + WRITE_LIMIT]
        brick.request(IOMapWrite.put(DISPLAY.module_id, start + offset, portion))
    return lines


def set_flags(brick, flags):
    brick.request(DISPLAY.field("Flags").write(flags))


@given(image=arrays.arrays(np.bool_, (64, 100), elements=st.booleans(), fill=st.booleans()))
def test_what_was_drawn_is_seen(brick, image):
    draw(brick, image)
    assert np.array_equal(read_display(brick.link), image)


@pytest.mark.parametrize(("x", "y"), [(0, 0), (99, 63), (54, 7), (55, 8), (0, 8), (17, 40)])
def test_a_single_pixel_is_in_its_place(brick, x, y):
    draw(brick, np.zeros((64, 100), bool))
    spot = DISPLAY.field("Normal", y // 8).offset + x
    brick.request(IOMapWrite.put(DISPLAY.module_id, spot, bytes([1 << y % 8])))
    assert np.argwhere(read_display(brick.link)).tolist() == [[y, x]]


def test_a_message_covers_the_picture(brick):
    behind, before = np.zeros((64, 100), bool), np.zeros((64, 100), bool)
    behind[10], before[:, 20] = True, True
    draw(brick, behind)
    draw(brick, before, "Popup")
    try:
        set_flags(brick, DisplayFlag.ON | DisplayFlag.POPUP)
        assert np.array_equal(read_display(brick.link), before)
    finally:
        set_flags(brick, DisplayFlag.ON)
    assert np.array_equal(read_display(brick.link), behind)


class TooLong(SimTransport):
    """A transport that promises longer replies than the brick gives over USB."""

    max_telegram = BLUETOOTH_TELEGRAM_LIMIT


def test_a_display_of_which_bytes_are_lacking_is_an_error_and_no_picture(simulation):
    with Brick(TooLong(simulation)) as brick, pytest.raises(RemoteProtocolError, match="bytes of the display"):
        read_display(brick.link)


class Listener(SimTransport):
    """A transport that notes how long replies are."""

    def receive(self, timeout_s):
        reply = super().receive(timeout_s)
        self.lengths = [*getattr(self, "lengths", []), len(reply or b"")]
        return reply


def test_reads_are_as_long_as_the_firmware_allows_and_no_longer(simulation):
    with Brick(Listener(simulation)) as brick:
        read_display(brick.link)
        _flags, *lines, _flags_again = brick.link.transport.lengths
    assert lines == [9 + 55, 9 + 54] * 7 + [9 + 800 - 7 * (55 + 54)]


def test_the_command_writes_an_image(tmp_path, answered):
    out = tmp_path / "nxt.png"
    assert answered("screenshot", out, "--nxt", "sim://open", "--scale", "3") == {
        "address": "sim://open",
        "file": str(out),
        "width": 300,
        "height": 192,
    }
    image = cv2.imread(str(out))
    assert image.shape == (192, 300, 3)
    assert {tuple(color) for color in image.reshape(-1, 3).tolist()} == {GLASS}


def test_black_pixels_are_squares_of_ink(tmp_path):
    from nxtdrive.cli.commands import screenshot

    picture = np.zeros((64, 100), bool)
    picture[1, 2] = True
    screenshot._save(picture, 4, tmp_path / "nxt.png")
    image = cv2.imread(str(tmp_path / "nxt.png"))
    rows, columns = np.nonzero((image == INK).all(axis=2))
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (4, 7, 8, 11)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nxt.xyz"], "no image format ends in '.xyz'"),
        (["nowhere/nxt.png"], "No such file or directory"),
        (["nxt.png", "--scale", "0"], "scale must be a whole number"),
    ],
)
def test_what_cannot_be_written_is_reported(here, capsys, arguments, sentence):
    try:
        code = main(["screenshot", *arguments, "--nxt", "sim://open"])
    except SystemExit as left:
        code = left.code
    assert code == USAGE
    assert sentence in capsys.readouterr().err
