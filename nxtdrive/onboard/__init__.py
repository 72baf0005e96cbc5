"""What the brick itself has: files, programs, a display, a loudspeaker."""
