"""The three motor ports."""
