"""The adaptive profile: models the world, maps what is in the way, and weighs what to do next."""
