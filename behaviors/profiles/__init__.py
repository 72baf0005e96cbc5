"""The profiles: the skill for each state of a mission, and the choice after each failure."""
