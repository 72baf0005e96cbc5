"""Programs: the file format, the memory and the bytecode of the NXT's interpreter."""
