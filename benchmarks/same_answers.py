"""Whether two versions of the program answer alike: every number of fits, diagnoses, tables and a release.

    python -m benchmarks.same_answers make --out DIR [--only NAME ...]
    python -m benchmarks.same_answers compare BEFORE AFTER [--within 0.001]

`make` copies the recordings of $ADDB_DATA, fits, diagnoses and exports each, and builds a release of them;
called again, it goes on where it was stopped. `compare` lists every number that differs by more than that
share of the larger one; a column of a table is measured by its largest number. Fields of another name are
listed as gone and new. Times, dates and hashes are left aside, and sentences.
"""

import argparse
import json
import math
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.recordings import data_folder, described_folders
from solver.fitting.results.store import write_json

STEPS = {"fit": ("fit",), "diagnose": ("diagnose",), "export": ("export", "--to", "csv")}
RELEASE = (
    *("--licence", "LicenseRef-none", "--consent", "public", "--source", "same-answers"),
    *("--unreviewed", "--no-b3d", "--date", "2000-01-01", "--workers", "1"),
)
ASIDE = re.compile(r"sha256|cpu_s|wall|version|code|made_at|created|bytes|memory|environment|package", re.I)
NAMED_BY = ("name", "id", "trial", "target", "phase", "foot")  # entries of lists, whatever their order
IDENTIFIER = re.compile(r"[A-Za-z_][\w+.-]{0,40}")  # no sentence, date or hash


def make(out: Path, only: list[str]) -> None:
    """Answers of this version of the program; steps that are done, in whatever way they ended, are kept.

    Args:
        out: where copies and answers lie.
        only: parts of recordings' names; all where there are none.
    """
    for folder in recordings():
        name = str(folder.relative_to(data_folder())).replace("/", "__")
        if only and not any(part in name for part in only):
            continue
        copy, ends = out / "recordings" / name, out / "ends" / f"{name}.json"
        if not ends.exists():  # a copy without it may be a part
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(
                folder, copy, ignore=shutil.ignore_patterns("results"), copy_function=shutil.copyfile
            )
            ends.parent.mkdir(exist_ok=True)
            write_json(ends, {})
        done: dict[str, int] = json.loads(ends.read_text(encoding="utf-8"))
        for step, command in STEPS.items():
            if step not in done:
                done[step] = _run([command[0], str(copy), *command[1:]], ends.with_suffix(f".{step}.log"))
                write_json(ends, done)
        print(name, *(f"{step} {code}" for step, code in done.items()), flush=True)
    release = ["dataset", "build", str(out / "recordings"), "--out", str(out / "release"), *RELEASE]
    _run(release, out / "release.log")


def recordings() -> list[Path]:
    """Folders that describe a subject, and those that were found without a description."""
    described = described_folders()
    wild = [folder for folder in (data_folder() / "wild").glob("*") if folder.is_dir()]
    return sorted({*described, *wild} - {data_folder() / "wild" / name for name in ("scripts", "truth")})


def _run(command: list[str], log: Path) -> int:
    with log.open("w", encoding="utf-8") as file:
        program = [sys.executable, "-m", "addb_viewer", *command]
        return subprocess.run(program, stdout=file, stderr=subprocess.STDOUT, check=False).returncode


def compare(before: Path, after: Path, within: float) -> list[str]:
    """What differs between every answer and the one of the same file and field, a line each.

    Args:
        before, after: folders that `make` wrote.
        within: share of the larger number by which two may differ.
    """
    one, two = answer_files(before), answer_files(after)
    moved = Counter([f"{name}: gone" for name in one - two] + [f"{name}: new" for name in two - one])
    differing = []
    for name in sorted(one & two):
        was, now = _answers(before / name), _answers(after / name)
        for key in was.keys() ^ now.keys():
            pattern = re.sub(r"\[[^]]*\]", "[]", key)  # one line for all entries and recordings
            moved[f"{Path(name).name}: {pattern}: {'gone' if key in was else 'new'}"] += 1
        for key in sorted(was.keys() & now.keys()):
            difference = _difference(was[key], now[key], within)
            if difference:
                differing.append(f"{name}: {key}: {difference}")
    return [f"{line}, {count} times" for line, count in sorted(moved.items())] + differing


def answer_files(out: Path) -> set[str]:
    """JSON and tables of the answers, below a folder that `make` wrote."""
    kept = [*out.glob("ends/*.json"), *out.glob("recordings/*/results/**/*"), *out.glob("release/**/*")]
    return {
        str(f.relative_to(out))
        for f in kept
        if f.suffix in (".json", ".csv", ".parquet") and f.name != "build_log.json" and "solve-" not in str(f)
    }


def _answers(file: Path) -> dict[str, Any]:
    """Columns of a table; numbers and identifiers of a JSON file by their path."""
    if file.suffix == ".json":
        return dict(_fields(json.loads(file.read_text(encoding="utf-8")), ""))
    table = pd.read_parquet(file) if file.suffix == ".parquet" else pd.read_csv(file, low_memory=False)
    return {str(name): table[name] for name in table.columns if not ASIDE.search(str(name))}


def _fields(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            if not ASIDE.search(key) and not (key == "seconds" and isinstance(inner, dict)):  # of work
                yield from _fields(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        seen = Counter[str]()
        for k, inner in enumerate(value):
            names = (
                [str(inner[name]) for name in NAMED_BY if name in inner] if isinstance(inner, dict) else []
            )
            name = " ".join(names) or str(k)
            seen[name] += 1
            yield from _fields(
                inner, f"{path}[{name}]" if seen[name] == 1 else f"{path}[{name} {seen[name]}]"
            )
    elif value is None or isinstance(value, (bool, int, float)) or IDENTIFIER.fullmatch(str(value)):
        yield path, value


def _difference(was: Any, now: Any, within: float) -> str | None:
    """How two answers differ, in words; None if they do not."""
    if not isinstance(was, pd.Series):
        numbers = isinstance(was, (int, float)) and isinstance(now, (int, float))
        same = math.isclose(was, now, rel_tol=within, abs_tol=1e-12) if numbers else was == now
        return None if same else f"{was} → {now}"
    if len(was) != len(now):
        return f"{len(was)} → {len(now)} rows"
    if not all(pd.api.types.is_numeric_dtype(column) for column in (was, now)):
        words = [np.array([str(value) for value in column]) for column in (was, now)]
        rows = int((words[0] != words[1]).sum())
        return f"{rows} of {len(was)} rows differ" if rows else None
    one, two = (column.to_numpy(dtype=float, na_value=math.nan) for column in (was, now))
    off, largest = np.nan_to_num(abs(one - two)), np.nanmax(abs(np.r_[one, two, 0.0]))
    rows = int(((off > within * largest) | (np.isnan(one) != np.isnan(two))).sum())
    return f"{rows} of {len(one)} rows differ, by up to {off.max():.3g} of {largest:.3g}" if rows else None


def main() -> None:
    """Make the answers of this version, or compare those of two."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.same_answers", description=__doc__.split("\n")[0]
    )
    steps = parser.add_subparsers(dest="step", required=True)
    making = steps.add_parser("make")
    making.add_argument("--out", type=Path, required=True)
    making.add_argument("--only", nargs="*", default=[])
    comparing = steps.add_parser("compare")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    comparing.add_argument("--within", type=float, default=0.001)
    chosen = parser.parse_args()
    if chosen.step == "make":
        make(chosen.out.resolve(), chosen.only)
        return
    found = compare(chosen.before, chosen.after, chosen.within)
    print(*found, f"{len(found)} differences beyond {chosen.within:g}", sep="\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
