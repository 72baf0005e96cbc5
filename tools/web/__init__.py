"""The page in the browser: one robot to watch and to drive, its missions and its runs."""
