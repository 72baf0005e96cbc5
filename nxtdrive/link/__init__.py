"""The link to a brick: requests, timers, motions, reconnection."""
