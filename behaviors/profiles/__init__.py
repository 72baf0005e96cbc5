"""The profiles: what a mission does in each state, and what it chooses after a failure."""
