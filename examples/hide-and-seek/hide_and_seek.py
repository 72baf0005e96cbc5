"""Hide and seek: the robot counts to ten, then finds everyone who hides, and says who was found when.

python hide_and_seek.py sim://garden.toml
python hide_and_seek.py usb:// 0
"""

import sys
from pathlib import Path

from behaviors.executive import Report
from nxtdrive import open_brick, run_mission

MISSION = Path(__file__).with_name("hide_and_seek.toml")


def count_to_ten(address: str) -> None:
    """Count aloud: a beep a second, the last one longer."""
    with open_brick(address) as brick:
        for number in range(1, 11):
            brick.tone(880 if number == 10 else 440, 600 if number == 10 else 100)
            brick.sleep(1)


def score(report: Report) -> list[str]:
    """Say who was found when, and who won: the robot, if it found all."""
    lines = []
    for each in report.targets:
        found = each.outcome == "reached" and each.time_s is not None
        lines.append(f"{each.target}: found after {each.time_s:.0f} s" if found else f"{each.target}: not found")
    return [*lines, "The robot wins." if report.achieved else "The hiders win."]


def main() -> None:
    """Play on the brick of the first argument, with the camera of the second."""
    address, camera = [*sys.argv[1:], None, None][:2]
    count_to_ten(address or "sim://garden.toml")
    report = run_mission(MISSION, nxt=address or "sim://garden.toml", camera=camera)
    for line in score(report):
        print(line)


if __name__ == "__main__":
    main()
