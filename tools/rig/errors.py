"""Errors of the rig."""


class RigError(Exception):
    """The rig cannot do what was asked; the message says what to do next."""
