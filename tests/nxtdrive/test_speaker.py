"""The loudspeaker of the simulated brick."""

import pytest

from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.iomap import SOUND, SoundState


def state(brick):
    variable = SOUND.field("State")
    return variable.decode(brick.request(variable.read()).data)


@pytest.mark.parametrize("duration_ms", [10, 800])
def test_a_tone_sounds_for_its_time(lab, duration_ms):
    brick = lab().brick
    begun_s = brick.now()
    brick.speaker.tone(440, duration_ms)
    while state(brick) != SoundState.IDLE:
        brick.sleep(0.002)
    assert brick.now() - begun_s == pytest.approx(duration_ms / 1000, abs=0.02)


def test_a_sound_is_stopped(lab):
    brick = lab().brick
    brick.speaker.tone(440, 5000)
    brick.sleep(0.1)
    assert state(brick) == SoundState.TONE
    brick.speaker.stop()
    brick.sleep(0.1)
    assert state(brick) == SoundState.IDLE


@pytest.mark.parametrize("tone", [(220, 10), (14080, 0xFFFF)])
def test_the_ends_of_the_range_of_tones_are_played(lab, tone):
    lab().brick.speaker.tone(*tone)


@pytest.mark.parametrize(
    ("tone", "name"),
    [
        ((219, 10), "frequency_hz"),
        ((14081, 10), "frequency_hz"),
        ((440, 9), "duration_ms"),
        ((440, 65536), "duration_ms"),
    ],
)
def test_a_tone_that_the_brick_cannot_play_is_refused(lab, tone, name):
    with pytest.raises(LocalProtocolError, match=name):
        lab().brick.speaker.tone(*tone)


@pytest.mark.parametrize("level", range(5))
def test_each_volume_can_be_set(lab, level):
    speaker = lab().brick.speaker
    speaker.volume = level
    assert speaker.volume == level


@pytest.mark.parametrize("level", [-1, 5])
def test_a_volume_that_is_none_is_refused(lab, level):
    with pytest.raises(LocalProtocolError, match="volume"):
        lab().brick.speaker.volume = level
