"""The solver's numeric constants, sorted: `python scripts/constants.py [--list]`.

Counted are names that a module of `solver` gives a number, or something with a number in it, outside of
functions and classes, and settings with a numeric default (`setting(…)` in a class). What such a name of a
module is stands in `scripts/constants.toml`: physical, numerical or tuned; a name that is not there is not
sorted yet. A setting is tuned, since people may change it, unless the file says otherwise. A tuned one is
supported where its reason names a page of `benchmarks/`, or the file's table `support` does and words that
stand in it, or where a page on which numbers are halved and doubled (`benchmarks/SETTINGS.md` and its like)
says that it stands. The same pages tell which decide nothing on their recordings, and of which another value
is better by no more than chance. A benchmark of the whole that never varied this number is no support.
"""

import argparse
import ast
import functools
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOM = "solver"
PHYSICAL, NUMERICAL, TUNED = "physical", "numerical", "tuned"
SUPPORTED, UNSUPPORTED, UNSORTED = "tuned, supported", "tuned, unsupported", "not sorted"
WITHOUT_EFFECT, BY_CHANCE = "tuned, no effect", "tuned, by chance"
COLUMNS = (PHYSICAL, NUMERICAL, SUPPORTED, WITHOUT_EFFECT, BY_CHANCE, UNSUPPORTED, UNSORTED)
VARIED = [
    *(f"benchmarks/{of}SETTINGS.md" for of in ("", "ACTIVITY_", "DETECTION_", "GAIT_", "READING_")),
    "benchmarks/DIAGNOSIS_CONSTANTS.md",
    "benchmarks/MADE_UP_SETTINGS.md",
    "benchmarks/MARKER_LABELS.md",
]
BY_HEADING = {
    "Stands": SUPPORTED,
    "Asks for a look": UNSUPPORTED,
    "May be chance": BY_CHANCE,
    "Decides nothing here": WITHOUT_EFFECT,
}
FIRST = (UNSUPPORTED, BY_CHANCE, SUPPORTED, WITHOUT_EFFECT)  # of what several pages say
SUPPORT = "support"  # a table of the register: "FILE NAME" = "benchmarks/PAGE.md: words"
PAGE = re.compile(r"benchmarks/\w+\.md")
ROW = re.compile(r"\| `([\w./]+)` \| `([\w.]+)` \|")


@dataclass(frozen=True)
class Constant:
    """One name with a number."""

    file: str  # below the room
    name: str  # of a setting with its class
    is_setting: bool
    reason: str  # of a setting

    @property
    def package(self) -> str:
        """The folder of the room that it lies in; of a file beside these, none."""
        return self.file.split("/")[0] if "/" in self.file else "(others)"


def main() -> int:
    """Print the figures; with `--list` also the names that are unsupported or not sorted."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("--list", action="store_true", help="name what is unsupported or not sorted")
    print_figures(listed=parser.parse_args().list)
    return 1 if stale(register()) else 0


def print_figures(*, listed: bool) -> None:
    """A row a package, a column a kind; and what the register says that is not so."""
    known = register()
    kinds = {constant: kind_of(constant, known) for constant in constants()}
    packages = Counter((constant.package, kind) for constant, kind in kinds.items())
    print(f"{'Numeric constants':18}" + "".join(f"{kind:>20}" for kind in COLUMNS))
    for package in sorted({constant.package for constant in kinds}):
        print(f"  {package:16}" + "".join(f"{packages[package, kind]:20}" for kind in COLUMNS))
    totals = Counter(kinds.values())
    print(f"  {'all':16}" + "".join(f"{totals[kind]:20}" for kind in COLUMNS))
    for kind in (UNSUPPORTED, UNSORTED) if listed else ():
        print(f"{kind}:")
        for constant in (constant for constant, its in kinds.items() if its == kind):
            print(f"  {constant.file} {constant.name}")
    for line in stale(known):
        print(f"scripts/constants.toml: {line}")


def register() -> Mapping[str, Mapping]:
    """What is known of constants, by file."""
    return tomllib.loads((ROOT / "scripts" / "constants.toml").read_text(encoding="utf-8"))


def constants() -> Iterator[Constant]:
    """All of the room, in the files' order."""
    room = ROOT / ROOM
    for path in sorted(room.rglob("*.py")):
        file = str(path.relative_to(room))
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                yield from _settings(file, node)
            elif isinstance(node, ast.Assign | ast.AnnAssign) and node.value and _has_number(node.value):
                for name in _names(node):
                    yield Constant(file, name, is_setting=False, reason="")


def kind_of(constant: Constant, known: Mapping[str, Mapping]) -> str:
    """One of `COLUMNS`."""
    of_file = known.get(constant.file, {})
    kind = next((kind for kind, names in of_file.items() if constant.name in names), None)
    if kind is None:
        kind = TUNED if constant.is_setting else UNSORTED
    if kind != TUNED:
        return kind
    said = f"{constant.reason} {known.get(SUPPORT, {}).get(f'{constant.file} {constant.name}', '')}"
    if any((ROOT / page).is_file() for page in PAGE.findall(said)):
        return SUPPORTED
    name = constant.name if constant.is_setting else f"{constant.file} {constant.name}"
    return varied().get(name, UNSUPPORTED)


@functools.cache
def varied() -> Mapping[str, str]:
    """What the pages of varied numbers say of a setting, by class and name, or of a constant, by its file."""
    found: dict[str, str] = {}
    for page in (ROOT / name for name in VARIED):
        kind = None
        for line in page.read_text(encoding="utf-8").splitlines() if page.is_file() else ():
            if line.startswith("## "):
                kind = BY_HEADING.get(line.removeprefix("## ").partition(":")[0])
            elif kind and (row := ROW.match(line)):
                name = f"{row[1]} {row[2]}" if row[1].endswith(".py") else row[2]
                found[name] = min(kind, found.get(name, kind), key=FIRST.index)
    return found


def stale(known: Mapping[str, Mapping]) -> list[str]:
    """Names of the register that are gone or have two kinds, and words that do not stand in their page."""
    there = {f"{constant.file} {constant.name}" for constant in constants()}
    said = [
        f"{file} {name}"
        for file, kinds in known.items()
        if file != SUPPORT
        for names in kinds.values()
        for name in names
    ]
    lines = [f"{name} is gone" for name in (*said, *known.get(SUPPORT, {})) if name not in there]
    lines += [f"{name} stands there twice" for name, times in Counter(said).items() if times > 1]
    for name, source in known.get(SUPPORT, {}).items():
        page, _, words = source.partition(": ")
        file = ROOT / page
        if not words or not file.is_file() or words not in file.read_text(encoding="utf-8"):
            lines.append(f"{name}: '{words}' does not stand in {page}")
    return lines


def _settings(file: str, of: ast.ClassDef) -> Iterator[Constant]:
    for node in of.body:
        match node:
            case ast.AnnAssign(
                target=ast.Name(id=name),
                value=ast.Call(func=ast.Name(id="setting"), args=[default, *_], keywords=keywords),
            ) if _has_number(default):
                reasons = [ast.unparse(keyword.value) for keyword in keywords if keyword.arg == "why"]
                yield Constant(file, f"{of.name}.{name}", is_setting=True, reason=" ".join(reasons))


def _has_number(value: ast.expr) -> bool:
    return any(
        isinstance(node, ast.Constant) and type(node.value) in (int, float) for node in ast.walk(value)
    )


def _names(node: ast.Assign | ast.AnnAssign) -> Iterator[str]:
    for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
        for part in ast.walk(target):
            if isinstance(part, ast.Name):
                yield part.id


if __name__ == "__main__":
    sys.exit(main())
