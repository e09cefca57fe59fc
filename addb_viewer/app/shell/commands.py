"""What keys, and the command palette, do: one table for the page, the help and the documentation."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from annotations.reasons import REASON_KEYS

MODIFIERS = ("Ctrl", "Alt", "Shift")  # in the order in which a key's name has them
NAMED = {
    "Space": "Space",
    "Enter": "Enter",
    "Backspace": "Backspace",
    "Delete": "Delete",
    "Insert": "Insert",
    "Escape": "Esc",
    "Home": "Home",
    "End": "End",
    "PageUp": "Page up",
    "PageDown": "Page down",
    "ArrowLeft": "←",
    "ArrowRight": "→",
    "ArrowUp": "↑",
    "ArrowDown": "↓",
    **{f"F{n}": f"F{n}" for n in range(1, 13)},
}  # as a browser names them: as people read them
SAME = {"esc": "Escape", "del": "Delete", "left": "ArrowLeft", "right": "ArrowRight", "up": "ArrowUp"} | {
    "down": "ArrowDown",
    "cmd": "Ctrl",
    "command": "Ctrl",
}  # other names of them
TAKEN = {
    **dict.fromkeys(("Ctrl+T", "Ctrl+N", "Ctrl+W", "Ctrl+Shift+T"), "the browser keeps it"),
    **dict.fromkeys(("Ctrl+Shift+N", "Ctrl+Shift+W", "Ctrl+Q"), "the browser keeps it"),
    **dict.fromkeys(("Ctrl+K", "Ctrl+Shift+P"), "it opens the list of commands"),
}  # keys that no command can have, and why


class KeyNameError(ValueError):
    """A text names no key; says why, without the text."""


@dataclass(frozen=True)
class Command:
    """Something a key, or the command palette (Ctrl+K), does."""

    label: str
    action: str  # name in the table of actions that the app provides, and in the file of keys
    keys: tuple[str, ...] = ()  # as `key_name` writes them
    held: bool = False  # whether a key that is held down does it again and again
    step_frames: int = 0  # by which the cursor moves
    step_s: float = 0.0  # likewise, at least one frame

    @property
    def shown(self) -> str:
        """The keys as people read them."""
        return " or ".join(key_words(key) for key in self.keys)


COMMANDS = (
    Command("Play or pause", "toggle", ("Space",)),
    Command("Loop the selected range", "loop", ("Shift+Space",)),
    Command("One frame back", "back_frame", (",", "ArrowLeft"), held=True, step_frames=-1),
    Command("One frame on", "on_frame", (".", "ArrowRight"), held=True, step_frames=1),
    # Not Shift with comma and period: what those make differs between keyboards.
    Command("0.1 s back", "back_tenth", ("Shift+PageUp", "Shift+ArrowLeft"), held=True, step_s=-0.1),
    Command("0.1 s on", "on_tenth", ("Shift+PageDown", "Shift+ArrowRight"), held=True, step_s=0.1),
    Command("1 s back", "back_second", ("PageUp",), held=True, step_s=-1.0),
    Command("1 s on", "on_second", ("PageDown",), held=True, step_s=1.0),
    Command("First frame", "first", ("Home",)),
    Command("Last frame", "last", ("End",)),
    Command("Worst frame that counts", "worst", ("W",)),
    Command("Worst marker", "worst_marker"),
    Command("Slower, or play backwards", "slower", ("J",)),
    Command("Stop", "stop", ("K",)),
    Command("Play, or faster", "faster", ("L",)),
    Command("Start of a range", "range_start", ("I",)),
    Command("End of a range", "range_end", ("O",)),
    *(Command(f"Flag: {key.words}", f"flag_{key.key}", (key.key,)) for key in REASON_KEYS),
    Command("Clear: the force counts", "flag_0", ("0",)),
    Command("Foot: right, left, both", "foot", ("F",)),
    Command("Next proposal or flagged range", "next", ("N", "ArrowDown")),
    Command("Previous proposal or flagged range", "previous", ("P", "ArrowUp")),
    Command("Accept the proposal", "accept_proposal", ("Enter",)),
    Command("Reject the proposal", "reject_proposal", ("Backspace",)),
    Command("What if this range were flipped", "what_if", ("Q",)),
    Command("Activity of the whole trial", "activity", ("A",)),
    Command("Undo", "undo", ("U", "Ctrl+Z")),
    Command("Redo", "redo", ("R", "Ctrl+Shift+Z", "Ctrl+Y")),
    Command("Yes, to the question", "yes", ("Y",)),
    Command("No, to the question", "no", ("Escape",)),
    Command("Solve again", "solve", ("G",)),
    Command("Keep the new solve (so does Y)", "keep", ("Shift+Enter",)),
    Command("Discard the new solve", "discard", ("Shift+Backspace",)),
    Command("Diagnose, or show the diagnosis", "diagnose", ("X",)),
    Command("Diagnose anew", "diagnose_anew"),
    Command("Show what the diagnosis names here", "show_diagnosis"),
    Command("Compare with the previous solve", "compare", ("M",)),
    Command("Finish the trial, go to the next", "finish", ("T",)),
    Command("Accept what is sure, finish, go to the next", "finish_sure", ("Shift+T",)),
    Command("Mark the trial unusable, go to the next", "unusable", ("B",)),
    Command("Choose a trial", "trials", ("C",)),
    Command("Fit all that have no fit", "fit_all"),
    Command("Cancel the fits of all", "cancel_fits"),
    Command("Go to a frame, or select frames", "go_to"),
    Command("Needs a second look", "second_look"),
    Command("Cancel what is at work", "cancel"),
    Command("Accept the named causes", "accept"),
    Command("Reject the named causes", "reject"),
    Command("Write a report of the fit", "report"),
    Command("Write the form on one page", "report_one_page"),
    Command("Record the fit for rerun", "record_rrd"),
    Command("Record the fit as MCAP", "record_mcap"),
    Command("Write the curves as CSV", "curves_csv"),
    Command("Fit the view to the person", "view_person", ("V",)),
    Command("View from the front", "view_front"),
    Command("View from the side", "view_side"),
    Command("View from the top", "view_top"),
    Command("Reset the view", "view_reset"),
    Command("Measure in the scene, or no longer", "measure", ("D",)),
    Command("Save a picture of the scene (PNG)", "picture"),
    Command("Save the selected frames as a film, or end that", "film"),
    Command("Dark or light", "theme"),
    Command("Change your name", "rename"),
    Command("Keys", "help", ("?",)),
)


def key_words(key: str) -> str:
    """A key as people read it.

    Args:
        key: as `key_name` writes it.
    """
    *modifiers, last = [key] if key == "+" else re.split(r"\+(?=.)", key)
    return " ".join([*modifiers, NAMED.get(last, last)])


def key_name(text: str) -> str:
    """A key's one name: Ctrl, Alt and Shift before it, letters as capitals, signs without Shift.

    Raises:
        KeyNameError: the text names no key, or one that no command can have.
    """
    *before, last = [part.strip() for part in re.split(r"\+(?=.)", text.strip())]
    modifiers = {SAME.get(part.lower(), part.capitalize()) for part in before}
    if unknown := modifiers - set(MODIFIERS):
        raise KeyNameError(f"'{min(unknown)}' does not go with other keys; Ctrl, Alt and Shift do")
    by_name = {name.lower(): name for name in NAMED} | SAME
    name = last.upper() if len(last) == 1 else by_name.get(last.lower().replace(" ", ""), "")
    if name not in NAMED and len(name) != 1:
        raise KeyNameError(f"no key is called '{last}'; a key is one character, or {', '.join(NAMED)}")
    if len(name) == 1 and not ("A" <= name <= "Z") and "Shift" in modifiers:
        raise KeyNameError(f"Shift does not go with '{name}'; write the character that the two make")
    key = "+".join([*(m for m in MODIFIERS if m in modifiers), name])
    if key in TAKEN:
        raise KeyNameError(f"no command can have {key}: {TAKEN[key]}")
    return key


def with_keys(commands: Sequence[Command], chosen: Mapping[str, tuple[str, ...]]) -> tuple[Command, ...]:
    """The commands with other keys. A key that is chosen for one is no longer another's.

    Args:
        commands: with the keys that they have by themselves.
        chosen: by action, the keys that it is to have instead.
    """
    taken = {key for keys in chosen.values() for key in keys}
    return tuple(
        replace(c, keys=chosen.get(c.action, tuple(key for key in c.keys if key not in taken)))
        for c in commands
    )
