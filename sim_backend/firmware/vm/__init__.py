"""Programs: file format, memory and bytecode of the NXT's interpreter."""
