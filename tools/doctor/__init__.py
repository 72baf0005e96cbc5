"""What keeps a computer and a brick from working together, and what to do about it."""
