"""Review of a run for people, besides its journal: hints at what to fix, and arrivals compared with the truth."""
