"""The four sensor ports: analog, colour and I2C."""
