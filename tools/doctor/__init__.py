"""Checks that find what keeps a computer and a brick from working together, and the remedies."""
