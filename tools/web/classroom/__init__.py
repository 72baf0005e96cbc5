"""A page for a whole classroom: many robots, each with a page of its own, started, watched and stopped together."""
