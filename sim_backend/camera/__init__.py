"""What a webcam on the simulated robot would see."""
