"""The map of a run: what happened, where, and how it is drawn."""
