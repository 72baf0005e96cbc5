"""Fault campaigns: many random trials of one promise each; docs/reliability.md states the promises and the figures."""
