"""The image of a webcam on the simulated robot."""
