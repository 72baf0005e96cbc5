"""Driving by hand in a terminal for half a minute."""

TELEOP = (
    "rm -f keys screen.txt; mkfifo keys; sleep 300 > keys 2>&1 & "
    "TERM=xterm-256color "
    "script -qfec 'stty rows 40 cols 120; nxtdrive teleop --nxt usb:// --camera 0' screen.txt < keys; "
    "code=$?; kill %1; exit $code"
)


def press(bench, key, seconds):
    """Hold a key down, as the terminal repeats it.

    A read that nobody answers takes the time: where the processor is emulated, starting `sleep` takes
    longer than it sleeps.
    """
    repeat = f"SECONDS=0; while ((SECONDS < {seconds})); do printf {key}; read -rt 0.1 -u 3; done > keys"
    bench.run(f"rm -f nobody; mkfifo nobody; exec 3<> nobody; {repeat}; true")


def test_the_keys_drive_until_they_are_let_go(bench):
    with bench.during(TELEOP) as done:
        bench.rig.wait_for("grep -aq 'T target' screen.txt", "the screen of teleop", 120.0)
        start = bench.rig.truth()["pose"]
        press(bench, "w", 8)
        bench.at_rest()
        ahead = bench.rig.truth()["pose"]
        press(bench, "d", 20)
        bench.at_rest()
        press(bench, "s", 1)
        bench.at_rest()
        bench.run("printf '\\033' > keys")
    assert done[0].code == 0, done[0].out[-2000:]
    assert ahead[0] > start[0] + 100
    assert bench.rig.truth()["contacts"] == 0
