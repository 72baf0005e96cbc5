"""`sim://?faults=FILE`: the faults of a file on the link of one program."""

import pytest

from firmware_protocol.errors import ConfigError, LinkError
from nxtdrive.brick import open_brick
from nxtdrive.mission.assembly import open_robot


@pytest.fixture
def address(tmp_path):
    def write(text):
        path = tmp_path / "faults.toml"
        path.write_text(text)
        return f"sim://open?faults={path}"

    return write


def test_a_weak_radio_makes_each_request_slow(address):
    with open_brick(address("weak_ms = [[0, 100000]]\nweak_latency_ms = [300, 600]\nweak_loss = 0")) as brick:
        begun_s = brick.now()
        assert brick.battery_v > 0
        assert brick.now() - begun_s >= 0.3


def test_a_mistake_in_the_file_is_reported(address):
    with pytest.raises(ConfigError, match="did you mean 'weak_ms'"), open_brick(address("weak = 3")):
        pass


def test_a_link_that_the_file_cuts_is_opened_again_for_a_mission(address):
    with open_robot(address("unplugged_ms = [[500, 1500]]")) as robot:
        robot.brick.sleep(1.0)
        with pytest.raises(LinkError):
            robot.brick.info()
        robot.brick.sleep(3.0)
        assert robot.brick.battery_v > 0
