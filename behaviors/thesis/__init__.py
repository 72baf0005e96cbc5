"""The behaviour of the thesis: its skills and its console. docs/thesis.md says what the thesis specifies."""
