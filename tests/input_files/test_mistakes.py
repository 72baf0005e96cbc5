"""What may have been meant by a wrong name, and lists of mistakes."""

from input_files.mistakes import LONGEST, LONGEST_VALUE, MAX_KNOWN, SHOWN, excerpt, hint, listed, nearest

MANY = [f"crate {number}" for number in range(MAX_KNOWN + 1)]


def test_the_nearest_of_a_few_names_is_found():
    assert nearest("crrate 7", ["table", "crate 7"]) == "crate 7"
    assert nearest("crate", ["table"]) == ""


def test_among_names_without_end_it_is_not_looked_for():
    """A file of thousands of wrong names would take minutes, and gigabytes for lists of the right ones."""
    assert nearest(MANY[0], MANY[:-1]) == MANY[0]
    assert nearest(MANY[0], MANY) == ""
    assert hint("crate", MANY) == f"known here: {', '.join(MANY[:MAX_KNOWN])}, ..."
    assert hint("shelf", MANY[:-1]) == f"known here: {', '.join(MANY[:-1])}"


def test_the_first_mistakes_are_listed_and_the_others_counted():
    problems = [f"mistake {number}" for number in range(SHOWN + 2)]
    assert listed(SHOWN, problems[:SHOWN]) == [f"{SHOWN} mistakes", *problems[:SHOWN]]
    assert listed(SHOWN + 2, problems) == [f"{SHOWN + 2} mistakes", *problems[:SHOWN], "and 2 more"]


def test_only_what_is_too_long_is_cut():
    assert listed(2, ["x" * LONGEST, "x" * (LONGEST + 1)])[1:] == ["x" * LONGEST, "x" * (LONGEST - 3) + "..."]
    whole = "x" * (LONGEST_VALUE - 2)
    assert excerpt(whole) == f"'{whole}'"
    assert excerpt(whole + "x") == f"'{whole[:-2]}..."
