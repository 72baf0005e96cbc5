"""Mistakes in files that are not TOML, and their places."""

import pytest

from input_files.plain import MAX_DEPTH, InputFileError
from input_files.toml_file import LINE_LIMIT, parse_toml, read_toml, toml_key, toml_string


def _refusal(path, content):
    path.write_bytes(content)
    with pytest.raises(InputFileError) as refusal:
        read_toml(path)
    return str(refusal.value)


@pytest.mark.parametrize("text", ["", 'a "quote" \\ tab\t', "\N{GRINNING FACE} кухня", "\x00\x1f\x7f\x80"])
def test_a_text_is_written_as_it_is_read(text):
    assert parse_toml(f"key = {toml_string(text)}") == {"key": text}
    assert parse_toml(f"{toml_key(text)} = 1") == {text: 1}


def test_only_a_key_that_needs_quotes_gets_them():
    assert [toml_key(key) for key in ("left_mm", "a-1", "a b", "naïve")] == ["left_mm", "a-1", '"a b"', '"naïve"']


@pytest.mark.parametrize(
    "line", [b"detector = picture  # without quotes", b'targets = ["cat" "dog"]', b'name = "a mission without an end']
)
def test_the_line_with_the_mistake_is_shown(tmp_path, line):
    said = _refusal(tmp_path / "cat.toml", b"[mission]\n\n" + line + b"\n[target]\n")
    assert "cat.toml is not TOML: " in said
    assert f"`{line.decode()}`" in said


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("wheel_diameter_mm = 56,0", "decimal point"),
        ("height_mm = 297 mm", "Write the number alone; the key's name says its unit."),
        ("time_limit_s = 60s   # a minute", "Write the number alone"),
        ("delay_replies_ms = { 4 = 500,5 }", "decimal point"),
        (r'pictures = ["C:\Users\me\cat.png"]', "write / for each"),
        ("name = “cat”", "plain quotation marks"),
        ("present = False", "true or false in small letters"),
        ("left_reversed = yes  # mounted the other way", "Write true or false."),
        ("left_reversed = Off", "Write true or false."),
        ('{"mission": {}}', "looks like JSON"),
        ("[target.kätzchen]", "between quotation marks"),
        ("[ target . kätzchen ]", "between quotation marks"),
        ("größe = 5", "name with letters beyond a-z between quotation marks"),
        ("detector = picture", "Put text between quotation marks"),
        ("targets = [my-cat]  # the [target.NAME] below", "Put text between quotation marks"),
        ("present = true, # or not", "Correct it there"),
        ('targets = ["kätzchen" "dog"]', "Write a comma between two texts."),
        ('targets = "cat", "dog"', 'Write several values as a list: ["a", "b"].'),
        ('targets: ["cat"]', "Write key = value, not key: value."),
        ("[target.my cat]", "Put a name with spaces between quotation marks."),
        ("[target.cat", "Close the bracket: ]."),
        ("[target.cat]\n[target.cat]", "It is there twice: give one another name, or remove it."),
        ("[boxes]\n[[boxes]]", "Write each of them with two brackets: [[boxes]]."),
        ("[[boxes]]\n[ boxes ]  # the second", "Write each of them with two brackets: [[boxes]]."),
        ('name = "a mission without an end\ntargets = []', "End the text with a quotation mark."),
        ("name = 'a mission without an end", "End the text with a quotation mark."),
        ('name = """a mission without an end', "End the text with a quotation mark."),
        ('targets = ["cat"\nrounds = 2', "Close the list: ]. It may begin in a line above."),
        ('targets = ["cat"', "Close the list: ]. It may begin in a line above."),
        ("delay_replies_ms = { 4 = 500", "Close the brace: }."),
        ("rounds = 2\nrounds = 3", "It is there twice: give one another name, or remove it."),
    ],
)
def test_a_common_mistake_has_a_hint(tmp_path, line, hint):
    assert hint in _refusal(tmp_path / "cat.toml", f"[mission]\n{line}\n".encode())


@pytest.mark.parametrize("end", ["rounds = 3", "rounds = 3\n", "[mission]", "[mission]\n\n"])
def test_a_key_or_table_twice_at_the_end_of_the_file_is_named(tmp_path, end):
    said = _refusal(tmp_path / "cat.toml", f"[mission]\nrounds = 2\n{end}".encode())
    assert f"`{end.strip()}`. It is there twice" in said


def test_a_long_line_is_cut(tmp_path):
    said = _refusal(tmp_path / "cat.toml", b"a = b" + b"c" * 1000)
    assert len(said) < 300


def test_only_the_beginning_of_a_long_line_is_searched_for_a_common_mistake(tmp_path):
    spaces = b" " * 2 * LINE_LIMIT
    assert "plain quotation marks" in _refusal(tmp_path / "cat.toml", "a = “cat”".encode() + spaces)
    assert "Correct it there." in _refusal(tmp_path / "cat.toml", b"a =" + spaces + "“cat”".encode())


@pytest.mark.parametrize("line", [b"a = " + b"=[" * 120_000, b"a = " + b" " * 240_000 + b"1 1"])
def test_a_line_as_long_as_a_file_may_be_is_refused_at_once(tmp_path, line):
    assert "Correct it there." in _refusal(tmp_path / "cat.toml", line)


@pytest.mark.parametrize("digits", [19, 5000])
def test_a_whole_number_of_more_than_64_bits_is_refused_in_words(tmp_path, digits):
    said = _refusal(tmp_path / "cat.toml", b"rounds = " + b"9" * digits)
    assert said.endswith("cat.toml is not TOML: it has a whole number of more than 64 bits. Correct it there.")


def test_a_mistake_at_the_end_of_the_file_has_no_line(tmp_path):
    assert "`" not in _refusal(tmp_path / "cat.toml", b"targets = [")


def test_the_line_that_is_not_utf_8_is_named(tmp_path):
    assert "line 3" in _refusal(tmp_path / "cat.toml", '[mission]\n\nname = "Kätzchen"'.encode("latin-1"))


@pytest.mark.parametrize("part", ["a", '"a b"', "'a'"])
@pytest.mark.parametrize(("between", "around"), [(".", "{} = 1"), (" . ", "{} = 1"), (".", "[{}]")])
def test_a_key_of_too_many_parts_is_refused_before_it_takes_memory(part, between, around):
    assert parse_toml(around.format(between.join([part] * MAX_DEPTH)))
    with pytest.raises(ValueError, match="it has a key of more than 32 parts"):
        parse_toml(around.format(between.join([part] * (MAX_DEPTH + 1))))


def test_a_file_that_is_much_larger_than_any_mission_is_refused(tmp_path):
    assert _refusal(tmp_path / "cat.toml", b"#" * 250_001).endswith("more than 0.25 MB. Choose another file.")
    (tmp_path / "cat.toml").write_bytes(b"#" * 250_000)
    assert read_toml(tmp_path / "cat.toml") == {}
