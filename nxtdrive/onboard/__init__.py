"""On board the brick: files, programs, display, loudspeaker."""
