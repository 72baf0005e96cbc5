"""Exercise 2: drive forward and stop 300 mm short of the obstacle ahead. Each test puts it somewhere else.

rover.range_mm()             how far it is, in mm; None without an echo
rover.drive(100, 0)          drives on at 100 mm a second, turning by 0 degrees a second; call it again and again
rover.stop()                 stops
brick.sleep(0.05)            waits; time.sleep would stop the simulation
"""

STOP_MM = 300


def stop_before_wall(brick, rover):
    """Drive forward and stop STOP_MM from the obstacle."""
    raise NotImplementedError("exercise 2 is not solved yet")
