"""Flash memory and its files."""
