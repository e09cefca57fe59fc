"""What a newcomer's first commands make of recordings as laboratories left them: benchmarks/ZOO.md.

    python -m benchmarks.zoo [--only NAME] [--out FOLDER] [--jobs 2]

Every set below $ADDB_DATA with a truth file (wild/truth/NAME.toml) or a subject.toml is laid out without any
description, and `init`, `fit` and `diagnose` run over it. Visits are kept, and made anew when the program's
code differs. A new recording needs a folder and a truth, no code. Where few sets of a kind lie there, sound
ones are changed by a script.
"""

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from benchmarks.markdown import write_section
from benchmarks.recordings import data_folder, described_folders
from benchmarks.zoo.changes import changed_sets
from benchmarks.zoo.judge import Answer, Check, checks
from benchmarks.zoo.truth import Truth, described_truth, read_truth
from benchmarks.zoo.visit import visited
from solver.common.errors import SolverError

PAGE = Path(__file__).parents[1] / "ZOO.md"
COLUMNS = ("feet", "off", "mass", "zero", "seen", "computed", "angles")
HEADS = (
    "forces on the right feet",
    "off the plates",
    "mass",
    "zero levels",
    "seen",
    "computed points",
    "angles",
)


@dataclass(frozen=True)
class Row:
    """One set, judged."""

    name: str
    why: str
    verdict: str  # "right", "refused", "told", "in silence", "crashed"
    checks: tuple[Check, ...]
    wrong: tuple[str, ...]
    silent: tuple[str, ...]

    @property
    def understood(self) -> bool:
        """At the first command."""
        return self.verdict in ("right", "refused")


def sets(out: Path) -> Iterator[tuple[Path, Truth]]:
    """Every set of recordings and what is so; changed ones are made below `out`."""
    wild = data_folder() / "wild"
    files = sorted((wild / "truth").glob("*.toml"))
    limits = read_truth(files[-1]).wrong_if if files else {}
    for file in files:
        yield wild / file.stem, read_truth(file)
    for folder in described_folders():
        if wild not in folder.parents:
            try:
                yield folder, described_truth(folder, limits)
            except SolverError as error:
                print(f"{folder.name}: {error}")
    yield from changed_sets(out / "changed", limits)


def judged(folder: Path, truth: Truth, out: Path) -> Row:
    """Visit a set and hold it against the truth."""
    visit = visited(folder, out / folder.name)
    answer = Answer(visit, truth)
    found = tuple(checks(answer))
    wrong = [check for check in found if not check.right]
    silent = [check.figure for check in wrong if not answer.told(check)]
    crashed = [f"{command} crashed" for command in visit.crashed]
    if crashed:
        verdict = "crashed"
    elif not wrong:
        verdict = "right" if answer.fits else "refused"
    else:
        verdict = "in silence" if silent else "told"
    wrong_words = (*crashed, *(check.figure for check in wrong))
    return Row(folder.name, truth.why, verdict, found, wrong_words, tuple(silent))


def page(rows: list[Row]) -> str:
    """The table, its answer first."""
    count = {
        verdict: sum(row.verdict == verdict for row in rows) for verdict in ("in silence", "told", "crashed")
    }
    understood = sum(row.understood for row in rows)
    silent, told, crashed = count["in silence"], count["told"], count["crashed"]
    head = f"""## Sets as laboratories left them

Of {len(rows)} sets of recordings as laboratories left them, **{understood} are understood at the first
command** ({understood / len(rows):.0%}); {told} are wrong and say so, {silent} are wrong in silence,
{crashed} crash.

Each set was laid out as found, and `init`, `fit` and `diagnose` ran over it. What is so was read from the raw
numbers by other code, or is what the laboratory states. Made by `python -m benchmarks.zoo`.

"""
    table = ["| set | answer | " + " | ".join(HEADS) + " | what is not right |"]
    table.append("|---" * (len(HEADS) + 3) + "|")
    for row in rows:
        wrong = "; ".join(f"**{w}**" if w in row.silent else w for w in row.wrong[:6])
        more = f"; {len(row.wrong) - 6} more" if len(row.wrong) > 6 else ""
        cells = [row.name, row.verdict, *(_cell(row, column) for column in COLUMNS), f"{wrong}{more}" or "–"]
        table.append("| " + " | ".join(cells) + " |")
    return head + "\n".join(table) + "\n\nBold: nothing that the program printed says so.\n"


def _cell(row: Row, column: str) -> str:
    found = [check for check in row.checks if check.column == column]
    if not found:
        return ""
    return f"{sum(check.right for check in found)} of {len(found)}"


def main() -> None:
    """Visit, judge, write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.zoo", description=__doc__)
    parser.add_argument(
        "--only", default="", help="parts of sets' names, with commas; the page is not written"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("build/zoo"), help="where copies and answers are kept"
    )
    parser.add_argument("--jobs", type=int, default=1, help="sets at once")
    chosen = parser.parse_args()
    parts = chosen.only.split(",")
    wanted = [(f, t) for f, t in sets(chosen.out.resolve()) if any(part in f.name for part in parts)]
    rows = []
    with ProcessPoolExecutor(chosen.jobs) as pool:
        jobs = [pool.submit(judged, folder, truth, chosen.out.resolve()) for folder, truth in wanted]
        for job in jobs:
            row = job.result()
            rows.append(row)
            print(
                f"{row.name}: {row.verdict}",
                *(f"\n    {w}{'' if w in row.silent else ' (told)'}" for w in row.wrong),
                flush=True,
            )
    if not chosen.only:
        write_section(PAGE, "zoo", page(rows))


if __name__ == "__main__":
    main()
