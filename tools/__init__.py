"""Leaf programs over the public API."""
