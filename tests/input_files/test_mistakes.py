"""What may have been meant by a wrong name."""

from input_files.mistakes import MAX_KNOWN, hint, nearest

MANY = [f"crate {number}" for number in range(MAX_KNOWN + 1)]


def test_the_nearest_of_a_few_names_is_found():
    assert nearest("crrate 7", ["table", "crate 7"]) == "crate 7"
    assert nearest("crate", ["table"]) == ""


def test_among_names_without_end_it_is_not_looked_for():
    """A file of thousands of wrong names would take minutes, and gigabytes for lists of the right ones."""
    assert nearest(MANY[0], MANY) == ""
    assert hint("crate", MANY) == f"known here: {', '.join(MANY[:MAX_KNOWN])}, ..."
