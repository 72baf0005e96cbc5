"""Programs on top of the public API."""
