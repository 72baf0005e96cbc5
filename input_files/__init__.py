"""Read files of people and other programs: regular files only, of limited size and depth, with one kind of error."""
