"""Telegrams: their links, and the handlers of the commands."""
