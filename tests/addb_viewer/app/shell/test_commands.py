"""The keys of the app, how they are called, and those that a person chooses in a file."""

from pathlib import Path

import pytest

from addb_viewer.app.shell.commands import COMMANDS, KeyNameError, key_name, key_words
from addb_viewer.app.shell.keys import KeyFileError, chosen_commands, help_html, key_file, page_html


def keys_of(commands):
    return {command.action: command.keys for command in commands}


def test_every_key_is_one_commands_is_called_as_in_the_file_and_is_in_the_help():
    keys = [key for command in COMMANDS for key in command.keys]
    assert len(set(keys)) == len(keys)
    assert [key_name(key) for key in keys] == keys
    page = help_html(COMMANDS)
    for command in COMMANDS:
        assert all(f">{key_words(key)}</b>" in page for key in command.keys)


def test_what_is_decided_by_key_has_one():
    has = {command.action for command in COMMANDS if command.keys}
    assert {"keep", "discard", "what_if", "activity", "worst", "loop", "view_person", "finish_sure"} <= has
    assert {"Ctrl+Z", "?", "Escape", "ArrowLeft"} <= {key for command in COMMANDS for key in command.keys}


@pytest.mark.parametrize(
    ("text", "name", "words"),
    [
        ("t", "T", "T"),
        ("shift + t", "Shift+T", "Shift T"),
        ("shift+CTRL+z", "Ctrl+Shift+Z", "Ctrl Shift Z"),
        ("cmd+z", "Ctrl+Z", "Ctrl Z"),
        ("?", "?", "?"),
        ("+", "+", "+"),
        ("Ctrl++", "Ctrl++", "Ctrl +"),
        ("page up", "PageUp", "Page up"),
        ("Left", "ArrowLeft", "←"),
        ("ö", "Ö", "Ö"),
    ],
)
def test_a_key_has_one_name_however_it_is_written(text, name, words):
    assert (key_name(text), key_words(key_name(text))) == (name, words)


@pytest.mark.parametrize("text", ["", " ", "enterr", "Hyper+T", "Shift+?", "Shift+1", "Ctrl+T", "cmd+k"])
def test_what_is_no_key_or_not_to_be_had_is_refused(text):
    with pytest.raises(KeyNameError):
        key_name(text)


def test_without_a_file_the_keys_are_the_usual_ones_and_it_lies_in_the_users_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert key_file() == tmp_path / "addb-viewer" / "keys.toml"
    assert chosen_commands() == COMMANDS
    monkeypatch.delenv("XDG_CONFIG_HOME")
    assert key_file() == Path.home() / ".config" / "addb-viewer" / "keys.toml"


def test_chosen_keys_take_the_place_of_usual_ones_and_show_in_the_help(tmp_path):
    file = tmp_path / "keys.toml"
    file.write_text('finish = "F8"\nwhat_if = ["H", "t"]\nundo = []\n')
    commands = chosen_commands(file)
    keys, usual = keys_of(commands), keys_of(COMMANDS)
    assert (keys["finish"], keys["what_if"], keys["undo"]) == (("F8",), ("H", "T"), ())
    assert {a: k for a, k in keys.items() if a not in ("finish", "what_if", "undo")} == {
        a: k for a, k in usual.items() if a not in ("finish", "what_if", "undo")
    }
    file.write_text('worst = "Enter"\n')
    assert keys_of(chosen_commands(file))["accept_proposal"] == (), "no longer the key of two"
    page = page_html(commands, str(file))
    assert "F8</b>" in page
    assert ">U</b>" not in page
    assert str(file) in page


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ('# mine\n\nundoo = "U"\n', 3, "no command is called 'undoo'. Nearest: undo"),
        ('undo = "U"\nredo = "Ctrl+T"\n', 2, "no command can have Ctrl+T: the browser keeps it"),
        ('undo = "enterr"\n', 1, "no key is called 'enterr'"),
        ('undo = "H"\n\nredo = "h"\n', 3, "H is the key of 'undo' already, in line 1"),
        ("next = 3\n", 1, 'Write next = "U", several as next = ["U", "Ctrl+Z"]'),
        ("[keys]\n", 1, "no command is called 'keys'"),
    ],
)
def test_a_wrong_line_is_named_with_what_to_do(tmp_path, text, line, said):
    file = tmp_path / "keys.toml"
    file.write_text(text)
    with pytest.raises(KeyFileError) as told:
        chosen_commands(file)
    assert str(told.value).startswith(f"{file}:{line}: ")
    assert said in str(told.value)


def test_a_file_that_is_no_toml_is_named_with_the_line(tmp_path):
    file = tmp_path / "keys.toml"
    file.write_text('undo = "U"\nredo = R\n')
    with pytest.raises(KeyFileError, match=r"keys\.toml: .*line 2"):
        chosen_commands(file)
