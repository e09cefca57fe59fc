"""How the modules hang together, in figures: `python scripts/structure.py [--list]`.

Counted are the modules of `solver`, `annotations` and `addb_viewer`, `__init__` aside. An importer of
a module is another module, or a package's `__init__`, of these three that names it in an import, wherever
that stands, imports for type checkers included; tests, benchmarks and scripts are none. A module that nobody
imports is started by its name. Lines are all lines of a file. A circle is a largest set of modules each of
which reaches every other one by imports. Circles, long files, and more than 5 short ones with one importer
are a failure, and so is what goes beyond a budget: who adds lines, words, settings or untyped dictionaries
takes some away elsewhere. Budgets go down; up only by what an issue asks for that was not there before.
"""

import argparse
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass
from pathlib import Path

import grimp
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]
PACKAGES = ("solver", "annotations", "addb_viewer")
SHORT = 70  # lines below which a module with one importer could stand with it
MOST_SHORT = 5
LONG = 500  # lines above which a module has two subjects

MOST = {
    "Lines of the product": 123_454,
    "Lines of tests": 74_346,
    "Lines of benchmarks": 11_683,
    "Pages of benchmarks": 9,
    "Lines of README.md": 120,
    "Words of docs": 53_850,
    "Settings": 120,
    "Untyped dictionaries": 232,
    "Names of two files or more": 0,
}

PRODUCT = ("*.py", "*.js", "*.css", "*.html")
UNTYPED = re.compile(r"(?:dict|Mapping)\[str, Any\]")
SETTING = re.compile(r"\bsetting\(")
SAME_NAMES = {"__init__.py", "settings.py", "__main__.py", "conftest.py"}

Importers = Mapping[str, Set[str]]  # by module, those that import it


def main() -> int:
    """Print the figures, with `--list` also what they count; 1 where they are beyond what is kept to."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("--list", action="store_true", help="name the modules as well")
    listed = parser.parse_args().list
    sys.path.insert(0, str(ROOT))
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    importers = {module: graph.find_modules_that_directly_import(module) for module in graph.modules}
    modules = {name: path for name in graph.modules if (path := _file(name)).is_file()}
    single = {name for name in modules if len(importers[name]) == 1}
    short = sorted(name for name in single if _lines(modules[name]) < SHORT)
    files = [*modules.values(), *(file for package in PACKAGES for file in (ROOT / package).rglob("*.js"))]
    long = sorted(str(file.relative_to(ROOT)) for file in files if _lines(file) > LONG)
    circles = list(circles_of(importers))
    print(f"Modules: {len(modules)}, with one importer: {len(single)}")
    print(f"With one importer and below {SHORT} lines: {len(short)}")
    _print_all(short if listed else ())
    print(f"Python or JavaScript files above {LONG} lines: {len(long)}")
    _print_all(long)
    print(f"Circles of imports: {len(circles)}")
    _print_all(" ".join(circle) for circle in circles)
    counts = list(counted())
    for count in counts:
        print(f"{count.what}: {count.found:,} of {count.most:,}")
    print("(python scripts/structure.py --help says how this is counted; --list names the short ones)")
    beyond = [count for count in counts if count.found > count.most]
    for count in beyond:
        print(f"Beyond its budget: {count.what}, by {count.found - count.most:,}. Take as much away.")
    return 1 if len(short) > MOST_SHORT or long or circles or beyond else 0


@dataclass(frozen=True)
class Count:
    """Something that may not grow."""

    what: str
    found: int
    most: int


def counted() -> Iterator[Count]:
    """What has a budget, of this folder as it is."""
    product = [file for package in PACKAGES for kind in PRODUCT for file in _files(package, kind)]
    python = [file for file in product if file.suffix == ".py"]
    names = Counter(file.name for file in python)
    for what, found in (
        ("Lines of the product", sum(map(_lines, product))),
        ("Lines of tests", sum(map(_lines, _files("tests", "*.py")))),
        ("Lines of benchmarks", sum(map(_lines, _files("benchmarks", "*.py")))),
        ("Pages of benchmarks", len(list((ROOT / "benchmarks").glob("*.md")))),
        ("Lines of README.md", sum(map(_lines, ROOT.glob("README.md")))),
        ("Words of docs", sum(len(_text(file).split()) for file in _files("docs", "*.md"))),
        ("Settings", _matches(SETTING, python)),
        ("Untyped dictionaries", _matches(UNTYPED, python)),
        ("Names of two files or more", sum(n > 1 and name not in SAME_NAMES for name, n in names.items())),
    ):
        yield Count(what, found, MOST[what])


def circles_of(importers: Importers) -> Iterator[list[str]]:
    """Largest sets of modules that all reach each other by imports.

    Args:
        importers: of every module.
    """
    names = sorted(importers)
    index = {name: i for i, name in enumerate(names)}
    edges = np.array(
        [(index[by], index[name]) for name, found in importers.items() for by in found], dtype=int
    ).reshape(-1, 2)
    arrows = coo_array((np.ones(len(edges)), edges.T), shape=(len(names), len(names)))
    _, labels = connected_components(arrows, directed=True, connection="strong")
    for label, size in enumerate(np.bincount(labels)):
        if size > 1:
            yield [names[i] for i in np.flatnonzero(labels == label)]


def _files(folder: str, pattern: str) -> Iterator[Path]:
    return (ROOT / folder).rglob(pattern)


def _matches(pattern: re.Pattern[str], files: Iterable[Path]) -> int:
    return sum(len(pattern.findall(_text(file))) for file in files)


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


def _file(module: str) -> Path:
    return ROOT / f"{module.replace('.', '/')}.py"


def _lines(file: Path) -> int:
    return len(_text(file).splitlines())


def _print_all(lines: Iterable[str]) -> None:
    for line in lines:
        print(f"  {line}")


if __name__ == "__main__":
    sys.exit(main())
