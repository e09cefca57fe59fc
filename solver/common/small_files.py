"""TOML and JSON files from untrusted sources: bounded in size and depth before they are parsed."""

import json
import re
import tomllib
from collections.abc import Callable
from functools import lru_cache, wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

DEEPEST = 64  # brackets within brackets, and parts of a dotted key; ours have four at most
MOST_TOML_BYTES = 1 << 20  # a `subject.toml` of a thousand trials has a tenth of that
MOST_JSON_BYTES = 1 << 28  # a review.json of a million frames has 7 MB; a fit's skeleton a few

_TOML_TEXT = re.compile(  # texts and comments, whose brackets and dots mean nothing; an open one to its end
    r'"""(?:\\.|[^\\])*?(?:"""|\Z)'
    r"|'''.*?(?:'''|\Z)"
    r'|"(?:\\.|[^"\\\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_DOTTED = re.compile(rf"(?<![\w\s-])[\w\s-]*+(?:\.[\w\s-]*+){{{DEEPEST},}}")


class BrokenFileError(ValueError):
    """What is wrong with a file and what to do, without its name."""


def lies_there(path: Path) -> bool:
    """Whether a folder holds the file of a name that is read wherever it is found.

    Raises:
        BrokenFileError: something is there that was meant to be read and is not: a link to nowhere, a folder,
            a pipe, or the name in another case.
    """
    if path.is_file():
        return True
    if path.is_symlink():
        raise BrokenFileError(
            f"a link to {path.readlink()}, which does not exist. Correct the link or remove it."
        )
    if path.exists():
        raise BrokenFileError("not a file. Move it away.")
    if path.parent.is_dir():
        for other in path.parent.iterdir():
            if other.name.lower() == path.name.lower():
                raise BrokenFileError(f"is called {other.name} here, and would not be read. Rename it.")
    return False


def toml_tables(path: Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        OSError: it cannot be read.
        BrokenFileError: it is too large, too deep, or no TOML.
    """
    text = _text(path, MOST_TOML_BYTES)
    bare = _TOML_TEXT.sub("x", text)
    if _depth(bare) > DEEPEST or _DOTTED.search(bare):
        raise BrokenFileError(
            f"nested more than {DEEPEST} deep, in brackets or dotted keys. Correct the file or move it away."
        )
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise BrokenFileError(f"{_lower(str(error))}. Correct that line.") from error


def json_content(path: Path) -> Any:
    """What a JSON file holds.

    Raises:
        OSError: it cannot be read.
        BrokenFileError: it is too large, too deep, or no JSON.
    """
    return json_of(_text(path, MOST_JSON_BYTES))


def json_of(text: str) -> Any:
    """What a JSON text holds.

    Raises:
        BrokenFileError: it is too deep, or no JSON.
    """
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise BrokenFileError(
            f"line {error.lineno}, column {error.colno}: {_lower(error.msg)}. Correct that line."
        ) from error
    except RecursionError as error:
        raise BrokenFileError("nested too deeply. Write it again.") from error
    except ValueError as error:  # a number of thousands of digits
        raise BrokenFileError(f"{_lower(str(error))}. Write it again.") from error


def kept_while_unchanged(most: int) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """A function of files that is asked again once the time or size of one of them has changed.

    Args:
        most: answers that are kept.
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        kept = lru_cache(maxsize=most)(lambda _, *args, **more: function(*args, **more))

        @wraps(function)
        def ask(*args: P.args, **more: P.kwargs) -> T:
            found = [path.stat() for path in (*args, *more.values()) if isinstance(path, Path)]
            stamps = tuple((file.st_mtime_ns, file.st_size) for file in found)
            return kept(stamps, *args, **more)  # type: ignore[arg-type]

        return ask

    return decorate


def _text(path: Path, most: int) -> str:
    with Path(path).open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise BrokenFileError(
            f"larger than {most / 1e6:.0f} MB, too large for a file of this kind. Is it another file?"
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BrokenFileError(f"byte {error.start} is not UTF-8. Save the file as UTF-8 text.") from error


def _depth(bare: str) -> int:
    depth = deepest = 0
    for mark in re.findall(r"[\[\]{}]", bare):
        depth += 1 if mark in "[{" else -1
        deepest = max(deepest, depth)
    return deepest


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
