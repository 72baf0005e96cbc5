"""The adaptive profile: a mind that remembers what it saw, maps what is in its way, and weighs what to do next."""
