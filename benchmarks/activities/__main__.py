"""`python -m benchmarks.activities [--learn] [--kept FOLDER]`: into benchmarks/ACTIVITIES.md."""

import argparse
import tempfile
from pathlib import Path

from benchmarks.activities.judging import Answer, answers
from benchmarks.activities.learning import learnt, write_weights
from benchmarks.activities.looking import Look, looked_at
from benchmarks.activities.page import PAGE, Judged, page_of
from benchmarks.activities.recorded import recorded
from benchmarks.activities.simulated import JUDGED, TAUGHT, simulated


def main() -> None:
    """Make, look, learn, judge, write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.activities", description=__doc__)
    parser.add_argument(
        "--learn", action="store_true", help="put the weights of all examples into the solver"
    )
    parser.add_argument(
        "--kept", type=Path, help="folder in which motions are kept: making them takes minutes"
    )
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = asked.kept or Path(scratch)
        taught = [looked_at(e) for e in simulated(TAUGHT, folder / "sim")]
        others = [looked_at(e) for e in simulated(JUDGED, folder / "sim")]
        real = [looked_at(e) for e in recorded(folder / "rec")]
    if asked.learn:
        write_weights(learnt([*taught, *real]), [*taught, *real])
    by_simulation = learnt(taught)
    judged = Judged(
        simulated=[answers(look, by_simulation) for look in others],
        nameless=left_out(taught, real, named=False),
        named=left_out(taught, real, named=True),
    )
    PAGE.write_text(page_of(judged, taught), encoding="utf-8")


def left_out(taught: list[Look], real: list[Look], *, named: bool) -> list[list[Answer]]:
    """Each recording by weights that were learnt without its source.

    Args:
        taught: simulated examples.
        real: recordings.
        named: whether the trial keeps its name, which is a hint.
    """
    by_source = {
        source: learnt([*taught, *(look for look in real if look.source != source)])
        for source in {look.source for look in real}
    }
    return [
        answers(look, by_source[look.source], look.example.trial.rpartition(" ")[2])
        if named
        else answers(look, by_source[look.source])
        for look in real
    ]


if __name__ == "__main__":
    main()
