"""The owner of the wire: requests, timers, reconnection."""
