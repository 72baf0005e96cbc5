"""A machine that sorts bricks by colour: they slide past a colour sensor, and a chute turns to the box of their colour.

The colour sensor (port 3) looks at the slide, the motor on A turns the chute, a touch sensor (port 1) ends the work.
"""

from collections import Counter

from nxtdrive import Brick, open_brick

BOXES_DEG = {"RED": -90, "YELLOW": -30, "GREEN": 30, "BLUE": 90}
"""Angle of the chute for each colour; a brick of another colour goes straight down."""
OTHERS_DEG = 0
SPEED_DEG_S = 300
NOTHING = ("BLACK",)
"""What the sensor sees of the slide itself."""
SURE = 3
"""A colour must be seen this often in a row: between two colours the sensor sees a mixture."""


def next_color(brick: Brick) -> str | None:
    """Wait until another brick has passed the sensor; returns its colour, or None when the touch sensor is pressed."""
    eye, button = brick.color(3), brick.touch(1)
    seen, times, free = "", 0, False
    while not button.pressed:
        color = eye.color.name
        times = times + 1 if color == seen else 1
        seen = color
        if times == SURE:
            if color not in NOTHING and free:
                return color
            free = color in NOTHING  # the brick before this one has left
    return None


def sort(brick: Brick) -> Counter[str]:
    """Sort until the touch sensor is pressed; returns how many there were of each colour."""
    chute = brick.motor("A")
    counted: Counter[str] = Counter()
    while (color := next_color(brick)) is not None:
        chute.run_target(SPEED_DEG_S, BOXES_DEG.get(color, OTHERS_DEG))
        counted[color] += 1
    chute.run_target(SPEED_DEG_S, OTHERS_DEG)
    return counted


def main() -> None:
    """Sort with the brick that $NXT names, or the first one on USB."""
    with open_brick() as brick:
        for color, count in sort(brick).items():
            print(f"{color.lower()}: {count}")


if __name__ == "__main__":
    main()
