"""How long an edit takes until it is on the disk, and how long a trial's state takes to be folded."""

import argparse
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from annotations.events import (
    AcceptProposal,
    ClearRange,
    Event,
    FlagRange,
    Proposal,
    RejectProposal,
    SetActivity,
)
from annotations.folding import folded
from annotations.live_review import LiveReview
from annotations.log import ReviewLog
from annotations.reasons import REASON_KEYS

FRAMES = 10_000
EDITS = 500
REPEATS = 60
TRIAL = "walk"
FEET = ("calcn_r", "calcn_l")
PEOPLE = ("anna", "ben", "cleo")


def annotations_speed_table(url: str | None = None) -> str:
    """What each thing takes on SQLite and, with a URL, on PostgreSQL, whose server's CPU time is not counted.

    Args:
        url: of an empty PostgreSQL database.
    """
    with tempfile.TemporaryDirectory(dir=".") as scratch:  # where recordings would lie, not in memory
        places = {"SQLite": Path(scratch) / "annotations.sqlite", **({"PostgreSQL": url} if url else {})}
        columns = {name: _measured(place) for name, place in places.items()}
    head = f"| wall (95th percentile) / CPU [ms] | {' | '.join(columns)} |\n|---|{'---|' * len(columns)}\n"
    rows = [
        f"| {what} | {' | '.join(column[what] for column in columns.values())} |"
        for what in next(iter(columns.values()))
    ]
    return head + "\n".join(rows)


def _measured(place: Path | str) -> dict[str, str]:
    """Times by what was done, on a log that has the edits already."""
    rng = np.random.default_rng(0)
    with ExitStack() as stack:
        log = stack.enter_context(ReviewLog.open(place))
        other = stack.enter_context(ReviewLog.open(place))
        for k in range(EDITS):
            log.append(TRIAL, _event(rng), PEOPLE[k % len(PEOPLE)])
        edits = log.history(TRIAL)
        live = LiveReview(log, FEET)

        def append_and_show() -> None:
            log.append(TRIAL, _event(rng), "anna")
            live.refresh()
            live.review(TRIAL)

        return {
            "append an edit": _timed(lambda: log.append(TRIAL, _event(rng), "anna")),
            "undo, then redo it": _timed(lambda: (log.undo(TRIAL, "anna"), log.redo(TRIAL, "anna"))),
            f"fold {EDITS} edits": _timed(lambda: folded(TRIAL, edits, FEET)),
            "append, and fold all again for the screen": _timed(append_and_show),
            "look for others' edits, none there": _timed(live.refresh),
            "look for others' edits, one there": _timed(
                live.refresh, lambda: other.append("run", _event(rng), "ben")
            ),
            f"read and fold {EDITS} edits from the disk": _timed(lambda: log.review(TRIAL, FEET)),
        }


def _event(rng: np.random.Generator) -> Event:
    start = int(rng.integers(FRAMES - 1))
    end = min(FRAMES, start + 1 + int(rng.integers(400)))
    foot = (None, *FEET)[rng.integers(3)]
    reason = REASON_KEYS[rng.integers(len(REASON_KEYS))].reason
    proposal = Proposal(start, end, reason, foot, 0.8, {"missing_N": 120.5})
    return (
        FlagRange(start, end, reason, foot, "on the edge"),
        ClearRange(start, end, foot),
        AcceptProposal(proposal),
        RejectProposal(proposal),
        SetActivity(start, end, "walk", "overground"),
    )[rng.integers(5)]


def _timed(work: Callable[[], object], before: Callable[[], object] = lambda: None) -> str:
    """Median of the wall time, its 95th percentile, and the median of the CPU time [ms]."""
    wall, cpu = [], []
    for _ in range(REPEATS):
        before()
        start = time.perf_counter(), time.process_time()
        work()
        wall.append(1e3 * (time.perf_counter() - start[0]))
        cpu.append(1e3 * (time.process_time() - start[1]))
    return f"{np.median(wall):.1f} ({np.percentile(wall, 95):.1f}) / {np.median(cpu):.1f}"


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.annotations_speed", description=__doc__)
    arguments.add_argument("url", nargs="?", help="of an empty PostgreSQL database, to be measured as well")
    print(annotations_speed_table(arguments.parse_args().url))
