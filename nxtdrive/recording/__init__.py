"""The record of a run: journal, summary, map and video; and its explanation."""
