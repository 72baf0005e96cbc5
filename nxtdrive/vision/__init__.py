"""Cameras, detectors and the geometry between pixels and the world."""
