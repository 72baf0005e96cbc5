"""What commands show: decisions, explanations of runs, telegrams, rooms."""
