"""What a run leaves behind: journal, summary, map and video."""
