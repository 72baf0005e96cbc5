"""The driver: bricks, motors, sensors and the rover, over any transport."""
