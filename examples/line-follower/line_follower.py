"""A robot that follows the left edge of a black line, as fast as its light sensor lets it.

Motors B (left) and C (right) drive it; a light sensor on port 3 looks down, just in front of the wheels.
"""

from nxtdrive import Brick, open_brick

SPEED_MM_S = 160
GAIN = 4.0
"""Degrees a second of steering for each percent of brightness beside the edge."""


def calibrate(brick: Brick) -> float:
    """Swing over the line to see its black and the floor's white; returns the brightness of the edge between them."""
    rover, light = brick.rover(ultrasonic=None, touch=None), brick.light(3)
    seen = []
    for angle_deg in (40, -80, 40):
        motion = rover.turn(angle_deg, wait=False)
        while not motion.done:
            seen.append(light.percent)
            brick.sleep(0.02)
    return (min(seen) + max(seen)) / 2


def follow(brick: Brick, edge_percent: float, duration_s: float) -> None:
    """Follow the line for some time and stop."""
    rover, light = brick.rover(ultrasonic=None, touch=None), brick.light(3)
    end = brick.now() + duration_s
    while brick.now() < end:
        too_bright = light.percent - edge_percent  # on the floor: the line is to the right
        turn_deg_s = GAIN * too_bright
        rover.drive(SPEED_MM_S / (1 + abs(too_bright) / 20), turn_deg_s)  # slower in bends
        brick.sleep(0.02)
    rover.stop()


def main() -> None:
    """Follow the line for a minute with the brick that $NXT names, or the first one on USB."""
    with open_brick() as brick:
        edge_percent = calibrate(brick)
        print(f"The edge of the line reflects {edge_percent:.0f} %. Following it for a minute.")
        follow(brick, edge_percent, duration_s=60)
        turned = brick.motor("B").angle / 360
    print(f"The left wheel turned {turned:.0f} times.")


if __name__ == "__main__":
    main()
