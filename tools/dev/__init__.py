"""Programs for developers of this project; they run in a checkout and are not installed."""
