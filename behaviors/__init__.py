"""The mind: what the robot wants, does next and does when it fails; knows bodies and eyes only as ports."""
