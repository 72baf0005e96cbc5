"""The wire: telegrams declared once, framing, status bytes, IO maps and the dialogue. Standard library only, no I/O."""
