"""The commands of `nxtdrive`, a module each, named after them; `nxtdrive.cli.main` says what a module must have."""
