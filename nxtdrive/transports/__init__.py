"""Ways to a brick, by address scheme."""
