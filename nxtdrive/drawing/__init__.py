"""Pictures of the floor for people: a page with title, map, axes, legend and numbered events."""
