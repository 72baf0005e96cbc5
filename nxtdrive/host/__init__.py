"""The computer that the driver runs on: access rights of devices, and the Python environment."""
