"""Rules of the sound module, each as a short conversation with the answers of LEGO's firmware."""

import struct

import pytest

from firmware_protocol.direct import PlaySoundFile, PlayTone, StartProgram, StopSoundPlayback
from firmware_protocol.iomap import COMMAND, SOUND
from firmware_protocol.system import Close, Read
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble
from sim_backend.firmware.brick import SimBrick

FOREVER = [0x4025, 0]
SAMPLES, ADPCM, MELODY = 0x0100, 0x0101, 0x0600
IDLE, FILE, TONE = 0, 2, 3


class Loudspeaker:
    """A bench of which only the sound is of interest."""

    def __init__(self) -> None:
        self.bench = Bench(SimBrick())

    def send(self, command) -> None:
        self.bench.telegram(command.encode().hex())

    def put(self, **fields: int) -> None:
        for name, value in fields.items():
            self.send(SOUND.field(name).write(value))

    def field(self, name: str) -> int:
        spot = SOUND.field(name)
        return spot.decode(bytes.fromhex(self.bench.telegram(spot.read().encode().hex()))[9:])

    def store(self, name: str, kind: int, content: bytes, rate: int = 8000) -> None:
        data = struct.pack(">HHHH", kind, 0, rate, 0) + content
        loader = self.bench.brick.loader
        handle = loader.create(name, len(data))[1]
        loader.write(handle, data)
        loader.close(handle)

    def play(self, name: str, *, loop: bool = False) -> None:
        self.send(PlaySoundFile(loop, name))

    def can_read(self, handle: int) -> bool:
        reply = self.bench.telegram(Read(handle, 1).encode().hex())
        return bytes.fromhex(reply)[2] == 0

    def passes_until_idle(self) -> int:
        return next(passes for passes in range(3000) if not self.field("State"))


@pytest.mark.parametrize(
    ("hertz", "ms", "passes"),
    [
        (220, 10, 1), (220, 14, 5), (220, 100, 92), (100, 100, 92), (0, 100, 97), (0, 500, 497), (440, 100, 96),
        (500, 100, 95), (1000, 0, 7), (1000, 100, 97), (2000, 100, 100), (5000, 500, 531), (9000, 100, 113),
        (14080, 18, 20), (14080, 500, 598), (65535, 100, 118),
    ],
)  # fmt: skip
def test_a_tone_ends_when_its_last_wave_is_handed_over(hertz, ms, passes):
    speaker = Loudspeaker()
    speaker.send(PlayTone(hertz, ms))
    assert speaker.passes_until_idle() == passes


@pytest.mark.parametrize(("wait", "passes"), [(1, 99), (2, 98), (3, 97), (21, 97), (22, 101)])
def test_a_new_tone_waits_for_the_end_of_the_wave(wait, passes):
    speaker = Loudspeaker()
    speaker.send(PlayTone(220, 500))
    speaker.bench.control(f"!tick {wait}")
    speaker.send(PlayTone(1000, 100))
    assert speaker.passes_until_idle() == passes


@pytest.mark.parametrize(
    ("kind", "size", "rate", "passes"),
    [
        (SAMPLES, 40, 8000, 0), (SAMPLES, 127, 8000, 0), (SAMPLES, 128, 8000, 1), (SAMPLES, 192, 8000, 8),
        (SAMPLES, 300, 8000, 17), (SAMPLES, 700, 8000, 66), (SAMPLES, 700, 2000, 256), (SAMPLES, 700, 500, 256),
        (SAMPLES, 700, 3000, 174), (SAMPLES, 700, 65535, 33), (ADPCM, 200, 8000, 17), (ADPCM, 500, 8000, 82),
        (0x0700, 700, 8000, 0),
    ],
)  # fmt: skip
def test_a_file_ends_when_its_last_piece_is_handed_over(kind, size, rate, passes):
    speaker = Loudspeaker()
    speaker.store("a.rso", kind, bytes(size), rate)
    speaker.play("a.rso")
    assert speaker.passes_until_idle() == passes


@pytest.mark.parametrize(
    ("notes", "passes"), [([(440, 100), (880, 100)], 196), ([(440, 100), (0, 50), (1000, 100)], 242)]
)
def test_a_melody_is_played_note_by_note(notes, passes):
    speaker = Loudspeaker()
    speaker.store("a.rmd", MELODY, b"".join(struct.pack(">HH", *note) for note in notes))
    speaker.play("a.rmd")
    assert speaker.field("State") == FILE
    assert speaker.passes_until_idle() == passes - 1


@pytest.mark.parametrize("loop", [False, True])
@pytest.mark.parametrize("size", [1, 3, 65, 66, 67])
def test_a_damaged_melody_whose_last_note_is_cut_off_does_no_harm(size, loop):
    speaker = Loudspeaker()
    speaker.store("a.rmd", MELODY, bytes([1]) * size)
    speaker.play("a.rmd", loop=loop)
    speaker.bench.control("!tick 5000")
    assert bool(speaker.field("State")) is loop


@pytest.mark.parametrize(
    ("size", "wait", "passes"), [(700, 30, 35), (700, 66, 81), (700, 150, 78), (40, 1, 3), (40, 33, 2)]
)
def test_a_looped_file_ends_with_its_round_when_the_loop_is_taken_away(size, wait, passes):
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(size))
    speaker.play("a.rso", loop=True)
    speaker.bench.control(f"!tick {wait}")
    speaker.put(Mode=0)
    assert speaker.passes_until_idle() == passes


def test_the_sample_rate_of_the_map_is_used_once():
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(700))
    speaker.put(SampleRate=4000)
    for passes in (131, 96):  # the second one waits for the last slow pieces of the first
        speaker.play("a.rso")
        assert speaker.passes_until_idle() == passes


def test_a_replaced_file_leaves_one_piece():
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(700))
    speaker.store("m.rmd", MELODY, struct.pack(">HH", 440, 20))
    for interrupt, passes in ((PlayTone(440, 20), 74), (StopSoundPlayback(), 66)):
        speaker.play("a.rso")
        speaker.send(interrupt)
        speaker.bench.control("!tick 100")
        speaker.play("a.rso")
        assert speaker.passes_until_idle() == passes


def test_the_firmware_owns_the_running_flag():
    speaker = Loudspeaker()
    speaker.send(PlayTone(440, 100))
    speaker.put(Flags=0)
    assert speaker.field("Flags") == 2
    speaker.put(State=IDLE)
    speaker.bench.control("!tick 200")
    assert (speaker.field("Flags"), speaker.field("State")) == (2, IDLE)


@pytest.mark.parametrize(("mode", "state"), [(0, IDLE), (1, TONE), (2, IDLE), (3, TONE)])
def test_what_a_tone_does_at_its_end_depends_on_the_mode(mode, state):
    speaker = Loudspeaker()
    speaker.send(PlayTone(440, 50))
    speaker.put(Mode=mode)
    speaker.bench.control("!tick 100")
    assert speaker.field("State") == state


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_a_tone_that_is_said_to_be_a_file_goes_on_or_ends(mode):
    speaker = Loudspeaker()
    speaker.send(PlayTone(440, 500))
    speaker.put(Mode=mode, State=FILE)
    speaker.bench.control("!tick 1000")
    assert speaker.field("State") in (IDLE, FILE)


def test_a_missing_file_leaves_the_tone_and_a_bad_one_ends_it():
    speaker = Loudspeaker()
    speaker.store("bad.rso", 0x3132, b"")
    speaker.send(PlayTone(440, 500))
    speaker.put(Mode=0, Flags=1)
    assert speaker.field("State") == TONE
    speaker.play("bad.rso")
    assert speaker.field("State") == IDLE


def test_the_bench_tells_what_sounds():
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(700))
    assert speaker.bench.control("!sound") == "stopped done"
    speaker.play("a.rso")
    assert speaker.bench.control("!sound") == "file playing"
    speaker.send(PlayTone(30000, 5))
    assert speaker.bench.control("!sound") == "tone hz=30000 ms=5 vol=4 playing"


@pytest.mark.parametrize(
    ("first", "loop", "wait", "second", "passes"),
    [
        (400, True, 11, 40, 1), (400, True, 11, 64, 1), (400, True, 11, 128, 32), (400, True, 11, 300, 96),  # replaced
        (64, True, 11, 40, 1), (128, False, 11, 40, 20), (128, False, 21, 40, 10), (128, False, 46, 40, 0),  # ended
        (128, False, 46, 128, 17), (128, False, 11, 200, 84), (192, False, 46, 128, 49), (400, False, 136, 40, 23),
    ],
)  # fmt: skip
def test_the_pieces_of_a_file_queue_behind_those_of_the_file_before(first, loop, wait, second, passes):
    speaker = Loudspeaker()
    speaker.store("first.rso", SAMPLES, bytes(first), rate=2000)
    speaker.store("second.rso", SAMPLES, bytes(second), rate=2000)
    speaker.play("first.rso", loop=loop)
    speaker.bench.control(f"!tick {wait}")
    speaker.play("second.rso")
    assert speaker.passes_until_idle() == passes


@pytest.mark.parametrize(
    ("put", "seen"),
    [
        ({"Mode": 3, "Flags": 1}, (2, TONE)),
        ({"Mode": 255, "Flags": 1}, (2, TONE)),
        ({"Mode": 4, "Flags": 1}, (0, IDLE)),
        ({"Mode": 2, "Flags": 0x81}, (0x82, TONE)),
        ({"State": 2}, (0, IDLE)),
        ({"State": 3}, (0, IDLE)),
        ({"State": 5}, (0, 5)),
        ({"Flags": 0x82, "State": 4}, (0x80, IDLE)),
    ],
)
def test_the_map_starts_what_the_bits_of_the_mode_say(put, seen):
    speaker = Loudspeaker()
    speaker.put(**put)
    assert (speaker.field("Flags"), speaker.field("State")) == seen


def test_a_missing_file_leaves_sound_and_handles_as_they_are():
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(700), rate=2000)
    speaker.play("a.rso")
    speaker.bench.control("!tick 5")
    speaker.send(SOUND.field("SoundFilename").write("none.rso"))
    speaker.put(Flags=1)
    assert (speaker.field("State"), speaker.can_read(0)) == (FILE, True)


@pytest.mark.parametrize(("wait", "passes"), [(1, 30), (20, 11), (33, 30), (60, 3), (70, 25)])
def test_a_file_whose_handle_is_closed_ends_with_its_piece(wait, passes):
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(700), rate=2000)
    speaker.send(SOUND.field("SoundFilename").write("a.rso"))
    speaker.put(Flags=1)
    speaker.bench.control(f"!tick {wait}")
    speaker.send(Close(0))
    assert speaker.passes_until_idle() == passes


def read_positions(loop, size, passes):
    """Where a Read by the file's handle goes on, after these numbers of passes; None at its end."""
    content, found = bytes(number * 7 % 251 for number in range(size)), []
    for wait in passes:
        speaker = Loudspeaker()
        speaker.store("a.rso", SAMPLES, content)
        speaker.play("a.rso", loop=loop)
        speaker.bench.brick.tick(wait)
        reply = bytes.fromhex(speaker.bench.telegram(Read(0, 4).encode().hex()))
        found.append(content.index(reply[6:10]) if not reply[2] else None)
    return found


@pytest.mark.parametrize(
    ("loop", "size", "positions"),
    [
        (False, 240, {0: 128, 1: 192, 7: 192, 8: None}),
        (True, 240, {0: 128, 1: 192, 7: 192, 8: 64, 16: 64, 17: 128, 25: 192, 33: 64}),
        (True, 100, {0: 64, 5: 64, 100: 64}),
    ],
)
def test_a_sound_reads_its_file_two_pieces_ahead(loop, size, positions):
    assert read_positions(loop, size, positions) == list(positions.values())


def test_a_loop_whose_handle_is_closed_opens_its_file_again():
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(900))
    speaker.play("a.rso", loop=True)
    speaker.send(Close(0))
    speaker.bench.brick.tick(20)
    assert speaker.field("State") == FILE
    assert speaker.can_read(0)


@pytest.mark.parametrize(("loop", "status"), [(True, "00"), (False, "02")])
def test_a_program_waits_for_the_end_of_a_sound_file(loop, status):
    """Its start closes handle 0, which is the end of a file that is played once."""
    speaker = Loudspeaker()
    loader = speaker.bench.brick.loader
    program = assemble(Variables(), [FOREVER])
    handle = loader.create("p.rxe", len(program), linear=True).handle
    loader.write(handle, program)
    loader.close(handle)
    speaker.store("a.rso", SAMPLES, bytes(6400))
    speaker.play("a.rso", loop=loop)
    speaker.send(StartProgram("p.rxe"))
    speaker.bench.brick.tick(20)
    assert speaker.bench.telegram(COMMAND.field("ProgStatus").read().encode().hex())[18:] == status


@pytest.mark.parametrize(
    ("files", "passes"),
    [
        ("am", 127), ("mm", 31), ("mmm", 0), ("mmn", 433), ("ama", 59), ("amma", 66), ("ma", 67), ("n", 706),
        ("nn", 979),
    ],
)  # fmt: skip
def test_buffers_of_replaced_files_are_played_as_the_ring_counts_them(files, passes):
    """A ring of three buffers counts the third one as none; of a melody's last piece only a whole one is played."""
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(700))
    speaker.store("m.rmd", MELODY, struct.pack(">HH", 440, 20))
    notes = [(1000, 20)] * 16 + [(1000, 30)] * 16 + [(440, 500)]
    speaker.store("n.rmd", MELODY, b"".join(struct.pack(">HH", *note) for note in notes))
    for name in files:
        speaker.play({"a": "a.rso", "m": "m.rmd", "n": "n.rmd"}[name])
    assert speaker.passes_until_idle() == pytest.approx(passes, abs=2)  # the phase of the recordings' timer


def test_a_melody_leaves_the_sample_rate_of_the_map():
    speaker = Loudspeaker()
    speaker.store("m.rmd", MELODY, struct.pack(">HH", 440, 20))
    speaker.put(SampleRate=4000)
    speaker.play("m.rmd")
    assert speaker.field("SampleRate") == 4000


@pytest.mark.parametrize(
    ("size", "hertz", "wait", "passes"), [(192, 220, 5, 12), (192, 1000, 5, 8), (700, 440, 20, 68)]
)
def test_a_file_that_replaces_a_tone_waits_for_the_end_of_its_wave(size, hertz, wait, passes):
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(size))
    speaker.send(PlayTone(hertz, 200))
    speaker.bench.control(f"!tick {wait}")
    speaker.play("a.rso")
    assert speaker.passes_until_idle() == pytest.approx(passes, abs=1)  # the phase of the recordings' timer


@pytest.mark.parametrize(("rate", "wait", "passes"), [(8000, 0, 105), (2000, 10, 105), (2000, 0, 104), (2000, 90, 104)])
def test_a_tone_that_replaces_a_file_waits_for_the_end_of_its_sample(rate, wait, passes):
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(128), rate)
    speaker.play("a.rso")
    speaker.bench.control(f"!tick {wait}")
    speaker.send(PlayTone(5000, 100))
    assert speaker.passes_until_idle() == passes


def test_a_tone_ends_when_the_map_says_that_it_is_a_file():
    speaker = Loudspeaker()
    speaker.send(PlayTone(768, 40))
    speaker.put(State=FILE)
    assert (speaker.field("Flags"), speaker.field("State")) == (0, IDLE)


@pytest.mark.parametrize(("running", "ms", "passes"), [(0, 40, 30), (0, 100, 90), (2, 40, 1), (2, 100, 1)])
def test_a_file_of_the_map_waits_for_a_tone_unless_the_flag_says_that_one_is_running(running, ms, passes):
    speaker = Loudspeaker()
    speaker.store("a.rso", SAMPLES, bytes(128))
    speaker.send(PlayTone(300, ms))
    speaker.bench.control("!tick 4")
    speaker.bench.telegram("01950100080006000600" + b"a.rso\0".hex())
    speaker.bench.telegram(f"0195010008001a0003000{running | 1}0300")
    assert speaker.passes_until_idle() == pytest.approx(passes, abs=1)


@pytest.mark.parametrize(
    ("wait", "ms", "passes"), [(1, 10, 120), (18, 10, 103), (51, 10, 69), (71, 10, 68), (1, 200, 137), (51, 200, 137)]
)
def test_a_melody_goes_on_with_its_next_note_after_a_tone_that_has_ended(wait, ms, passes):
    """Four notes that were interrupted, and the same four of the next start."""
    speaker = Loudspeaker()
    speaker.store("m.rmd", MELODY, struct.pack(">HH", 1000, 20) * 4)
    speaker.play("m.rmd")
    speaker.bench.control(f"!tick {wait}")
    speaker.send(PlayTone(1000, ms))
    speaker.bench.control("!tick 20")
    speaker.play("m.rmd")
    assert speaker.passes_until_idle() == pytest.approx(passes, abs=2)


def test_a_state_of_the_map_plays_what_is_left_in_the_ring():
    speaker = Loudspeaker()
    speaker.store("m.rmd", MELODY, struct.pack(">HH", 1000, 20) * 4)
    speaker.play("m.rmd")
    speaker.send(PlayTone(1000, 10))
    speaker.put(State=FILE)
    assert speaker.field("State") == FILE
