"""Motors, precise and leased motion, and the rover with its safety stop."""
