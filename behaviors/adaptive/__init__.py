"""The adaptive profile: models the world, maps obstacles, and weighs what to do next."""
