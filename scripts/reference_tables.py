"""Write the parts of docs/ anew that the code says: `python scripts/reference_tables.py`.

Commands and options, keys, reasons, activities, tables of a release, causes and checks. Each stands between
two marks of its page, `<!-- NAME: made by … -->` and `<!-- end of NAME -->`.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from typer.main import get_command

from addb_viewer.app.shell.commands import COMMANDS as KEYS
from addb_viewer.commands.cli import app
from addb_viewer.dataset.build_task import REASONS as LEFT_OUT
from addb_viewer.dataset.release_tables import TABLES
from annotations.activities import ACTIVITIES
from annotations.reasons import REASONS, key_of, reason_words
from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.checks import CHECKS
from solver.export.b3d.from_fit import NEAREST

DOCS = Path(__file__).parent.parent / "docs"
OF_EVERY_COMMAND = {"--help", "--debug"}  # the page explains them once
SHARED_BY = 3  # commands that have an option with the same help: it stands in one table for all
ASKED_OF = {
    "HeldOut": "a cause that is added, exchanged or paired",
    "Added": "a cause that is added",
    "Kept": "a cause, once later ones are there",
    "OnReading": "a cause that reading undid",
    "BesideUnknown": "a named cause beside an unknown force",
    "AllInPlace": "all named causes together",
    "AgainstAnything": "a named cause at the end",
    "Remainder": "an unknown force",
}

Option = tuple[str, str]  # as people type it, and what it does


def table(*rows: tuple[str, ...]) -> str:
    """The first row is the head."""
    head, *body = ("| " + " | ".join(row) + " |" for row in rows)
    return "\n".join([head, "|" + "---|" * len(rows[0]), *body]) + "\n"


def commands(group: Any, before: str = "") -> Iterator[tuple[str, Any]]:
    """Every command by its words, those of groups too."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, f"{before}{name} ")
        else:
            yield f"{before}{name}", command.loaded()


def options(command: Any) -> list[Option]:
    """A command's options but for those that every command has."""
    return [
        (f"`{' '.join(filter(None, [option.opts[0], option.metavar]))}`", str(option.help))
        for option in command.params
        if option.opts[0].startswith("--") and option.opts[0] not in OF_EVERY_COMMAND
    ]


def usage(name: str, command: Any) -> str:
    """How a command is typed."""
    words = [p.metavar for p in command.params if not p.opts[0].startswith("--")]
    return " ".join(["    addb-viewer", name, *words, "[OPTIONS]"])


def about_command(name: str, command: Any, shared: set[Option]) -> str:
    """Usage, its own options, and which of the shared ones it has."""
    own = [option for option in options(command) if option not in shared]
    also = ", ".join(option for option, _ in options(command) if (option, _) in shared)
    parts = [usage(name, command)]
    parts += [table(("option", ""), *own).strip()] if own else []
    parts += [f"Also {also} ([shared](#options-that-commands-share))."] if also else []
    return "\n" + "\n\n".join(parts) + "\n\n"


def command_line() -> dict[str, str]:
    """The list of commands, shared options, and a part for each command."""
    known = dict(commands(get_command(app)))
    used = Counter(option for command in known.values() for option in options(command))
    often = [option for option, times in used.most_common() if times >= SHARED_BY]
    shared = sorted({option: (option, does) for option, does in reversed(often)}.values())  # one of each name
    listed = [
        (f"[`{name}`](#{name.replace(' ', '-')})", command.help.split("\n")[0])
        for name, command in known.items()
    ]
    parts = {"commands": table(("command", ""), *listed), "shared options": table(("option", ""), *shared)}
    return parts | {name: about_command(name, command, set(shared)) for name, command in known.items()}


def cause(one: About) -> tuple[str, ...]:
    """What a cause is."""
    return f"`{one.id}`", one.entry.target, one.entry.happened, one.entry.parameters


def beside(one: About) -> tuple[str, ...]:
    """What the diagnosis assumes of a cause."""
    sizes = "; ".join(f"`{s.parameter}` {s.usual:g} / {s.rare:g} / {s.most:g}: {s.why}" for s in one.sizes)
    assumed = (one.branch, one.at_fault.value, one.time_history.value, f"{one.odds_against:g}")
    return f"`{one.id}`", *assumed, one.corrected_by.value, sizes


def causes() -> dict[str, str]:
    """The catalogue, and what is assumed of each cause."""
    heads = ("id", "branch", "at fault", "over time", "odds", "corrected by", "sizes")
    return {
        "catalogue": table(("id", "target", "what happened", "parameters"), *map(cause, ABOUT.values())),
        "assumptions": table(heads, *map(beside, ABOUT.values())),
    }


def checks() -> dict[str, str]:
    """What decides about a cause."""
    asked = [(c.name, c.question, "; ".join(ASKED_OF[kind.__name__] for kind in c.asked_of)) for c in CHECKS]
    return {"checks": table(("check", "question", "asked of"), *asked)}


def keys() -> dict[str, str]:
    """Keys of the app, and commands without one."""
    rows = [(command.shown, command.label, f"`{command.action}`") for command in KEYS]
    return {"keys": table(("key", "does", "in the file"), *rows)}


def review_words() -> dict[str, str]:
    """Reasons with their keys and what of ours becomes them in a B3D file; activities."""
    own = {name: "; ".join(words for words, near in NEAREST.items() if near == name) for name in REASONS}
    reasons = [
        (str(number), f"`{name}`", key_of(name), reason_words(name), own[name])
        for number, name in enumerate(REASONS)
    ]
    reasons[0] = (*reasons[0][:2], "0", "the force counts", own[REASONS[0]])
    return {
        "reasons": table(("number", "reason", "key", "in words", "also, in B3D files"), *reasons),
        "activities": table(
            ("activity", "subclasses"), *((f"`{a}`", ", ".join(kinds)) for a, kinds in ACTIVITIES.items())
        ),
    }


def release() -> dict[str, str]:
    """Tables of a release, and why something is left out of it."""
    reasons = [
        (level, f"`{reason}`", words) for level, own in LEFT_OUT.items() for reason, words in own.items()
    ]
    parts = [
        f"### {one.name}\n\n{one.description}. `{one.path.format(subject='SUBJECT', name='NAME')}`; "
        f"key: {', '.join(one.key)}.\n\n{one.as_markdown()}\n"
        for one in TABLES
    ]
    return {
        "left out": table(("level", "reason", "holds when"), *reasons),
        "tables": "\n" + "\n".join(parts) + "\n",
    }


PAGES = {
    "reference/command-line.md": command_line,
    "reference/app.md": keys,
    "reference/annotations.md": review_words,
    "reference/dataset.md": release,
    "reference/causes.md": causes,
    "explanation/diagnosis.md": checks,
}


def renewed(page: str, parts: Mapping[str, str]) -> str:
    """The page with its parts as they should be.

    Raises:
        ValueError: a part has no place on the page.
    """
    for name, text in parts.items():
        start, end = f"<!-- {name}: made by scripts/{Path(__file__).name} -->\n", f"<!-- end of {name} -->"
        before, found, rest = page.partition(start)
        if not found or end not in rest:
            raise ValueError(f"the page has no place for '{name}': write {start.strip()} and {end} there")
        page = before + start + text + end + rest.split(end, 1)[1]
    return page


if __name__ == "__main__":
    for place, made in PAGES.items():
        file = DOCS / place
        file.write_text(renewed(file.read_text(encoding="utf-8"), made()), encoding="utf-8")
