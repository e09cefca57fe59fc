"""How the modules hang together, in figures: `python scripts/structure.py [--list]`.

Counted are the modules of `solver`, `annotations` and `addb_viewer`, `__init__` aside. An importer of
a module is another module, or a package's `__init__`, of these three that names it in an import, wherever
that stands, imports for type checkers included; tests, benchmarks and scripts are none. A module that nobody
imports is started by its name. Lines are all lines of a file. A circle is a largest set of modules each of
which reaches every other one by imports. Circles, long files, and more than 15 short ones with one importer
are a failure.
"""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Set
from pathlib import Path

import grimp
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]
PACKAGES = ("solver", "annotations", "addb_viewer")
SHORT = 70  # lines below which a module with one importer could stand with it
MOST_SHORT = 15
LONG = 500  # lines above which a module has two subjects

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
    print("(python scripts/structure.py --help says how this is counted; --list names the short ones)")
    return 1 if len(short) > MOST_SHORT or long or circles else 0


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


def _file(module: str) -> Path:
    return ROOT / f"{module.replace('.', '/')}.py"


def _lines(file: Path) -> int:
    return len(file.read_text(encoding="utf-8").splitlines())


def _print_all(lines: Iterable[str]) -> None:
    for line in lines:
        print(f"  {line}")


if __name__ == "__main__":
    sys.exit(main())
