"""Exercise 2, solved."""

STOP_MM = 300


def stop_before_wall(brick, rover):
    """Drive forward and stop STOP_MM from the obstacle."""
    while (range_mm := rover.range_mm()) is None or range_mm > STOP_MM + 20:
        rover.drive(100, 0)
        brick.sleep(0.02)
    rover.stop()
