"""Fault campaigns: many random trials of one guarantee each; docs/reliability.md states them with their figures."""
