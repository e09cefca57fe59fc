"""What the diagnosis says about every real recording, as the table of docs/findings.md.

    python -m benchmarks.findings [--only NAME] [--keep FOLDER] [--minutes 60]

A subject's trials together, then each by itself; where people flagged frames, again without their flags.
Every answer is kept in FOLDER as soon as it is there and made only once, so that a stopped program goes on
where it was. Remove FOLDER after changes of the solver.
"""

import argparse
import hashlib
import json
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from addb_viewer.jobs.solving import Job, job_for
from benchmarks.recordings import data_folder, subjects
from benchmarks.sections import write_section
from solver.capture.capture import Subject
from solver.common.errors import SolverError
from solver.diagnosis.diagnose import diagnose
from solver.diagnosis.report import as_json
from solver.fitting.provenance import provenance_of
from solver.fitting.results.store import write_json
from solver.fitting.settings import as_dict

PAGE = Path(__file__).resolve().parents[1] / "docs" / "findings.md"
KEPT = Path("build/findings")
FORCE, MOMENT = "held_out_linear_residual_N", "held_out_angular_residual_Nm"
HEAD = (
    "| recording | trials | verdict | causes | force N, before → after (95 %) | moment N·m "
    "| left, of ordinary N | left where | CPU s |\n|---|---|---|---|---|---|---|---|---:|"
)

Figures = Mapping[str, Any]


@dataclass(frozen=True)
class Case:
    """One diagnosis that is wanted."""

    recording: str  # folder below the data
    folder: Path
    trials: tuple[str, ...] | None  # None: all together
    without_flags: bool  # what people flagged is left out

    @property
    def key(self) -> str:
        """Name of the file that keeps it."""
        trials = "+".join(self.trials) if self.trials else "all"
        return "__".join([self.recording.replace("/", "_"), trials, *["noflags"] * self.without_flags])


def cases_of(name: str, subject: Subject) -> list[Case]:
    """All trials together, several also one by one, and all that without people's flags if there are any."""
    names = [trial.name for trial in subject.trials]
    groups = [None, *[(n,) for n in names]] if len(names) > 1 else [None]
    flagged = any(bool(trial.reviews) for trial in subject.trials)
    return [
        Case(name, subject.folder, group, without)
        for without in ((False, True) if flagged else (False,))
        for group in groups
    ]


def answer(case: Case, keep: Path, deadline: float) -> dict[str, Any]:
    """The kept answer, else a new one: figures of `diagnose --json`, or why there are none.

    Args:
        case: what is wanted.
        keep: folder of the answers.
        deadline: CPU time of this program [s] after which no new one is begun.
    """
    file = keep / f"{case.key}.json"
    begin = time.process_time()
    try:
        job = job_for(
            case.folder, trials=case.trials, ignore_review=case.without_flags, without_extension=True
        )
        inputs = _fingerprint(job)
        if file.exists():
            kept: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            if kept["inputs"] == inputs:
                return kept
        if begin > deadline:
            return {"refused": "not made yet"}
        found = diagnose(job.subject, job.settings, trials=job.trials, reviews=job.reviews)
    except SolverError as error:
        return {"refused": str(error).replace(f"{data_folder()}/", "")}
    kept = {"inputs": inputs, "cpu_s": time.process_time() - begin, "figures": as_json(found)}
    kept["gain_nats"] = [[_finite(e.gain_nats), _finite(e.held_out_gain_nats)] for e in found.effects]
    write_json(file, kept)
    return kept


def _fingerprint(job: Job) -> str:
    chosen = [t for t in job.subject.trials if job.trials is None or t.name in job.trials]
    made_from = (provenance_of(job.subject, chosen, job.reviews), as_dict(job.settings))
    return hashlib.sha256(json.dumps(made_from, default=str).encode()).hexdigest()


def row(case: Case, kept: Figures) -> str:
    """One line of the table."""
    figures = kept["figures"]
    causes = [
        _cause(figures, effect, gain)
        for effect, gain in zip(figures["effects"], kept["gain_nats"], strict=True)
    ]
    remaining = figures["remaining"]
    where = remaining["location"]
    cells = [
        f"`{case.recording}`",
        ", ".join(figures["trials"]) + (", people's flags left out" if case.without_flags else ""),
        figures["verdict"],
        "<br>".join(causes) or "–",
        _gain(figures["gain"].get(FORCE), 0),
        _gain(figures["gain"].get(MOMENT), 1),
        f"{remaining['linear_residual_N']:.0f} of {remaining['noise_floor_N']:.0f}",
        f"{where['body']}, {where['rms_force_N']:.0f} N" if where else "–",
        f"{kept['cpu_s']:.0f}",
    ]
    return f"| {' | '.join(cells)} |"


def _cause(figures: Figures, effect: Figures, gain: Sequence[float | None]) -> str:
    values = ", ".join(
        f"{name} {_rounded(estimate['value'], '.3g')} ± {_rounded(estimate['std'], '.2g')}"
        for name, estimate in effect["parameters"].items()
    )
    rivals = [
        f"{a['id']} {a['target']}"
        for a in figures["alternatives"]
        if a["instead_of"] == f"{effect['id']} {effect['target']}"
    ]
    spans = effect["frames"]
    some = " ".join(str(span) for span in spans[:4]) + (f" and {len(spans) - 4} more" * (len(spans) > 4))
    lead = "tentative: " if effect.get("told_as") == "tentative" else ""
    return (
        f"{lead}**{effect['id']} {effect['target']}** {values}; frames {some}; "
        f"sure {effect['confidence']:.2f}, "
        f"{_rounded(gain[0], '.0f')} nats, held-out {_rounded(gain[1], '.0f')}"
        + (f"; or {', '.join(rivals)}" if rivals else "")
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _rounded(value: float | None, form: str) -> str:
    return "?" if value is None else f"{value:{form}}"


def _gain(gain: Figures | None, digits: int) -> str:
    if gain is None:
        return "–"
    low, high = gain.get("interval") or (gain["after"], gain["after"])
    return f"{gain['before']:.{digits}f} → {gain['after']:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"


def answers(only: str, keep: Path, deadline: float) -> Iterator[tuple[Case | str, Figures]]:
    """Every case and its answer; a folder's name where it does not open."""
    for name, subject in subjects():
        if only not in name:
            continue
        if isinstance(subject, SolverError):
            yield name, {"refused": str(subject).replace(f"{data_folder()}/", "")}
            continue
        for case in cases_of(name, subject):
            yield case, answer(case, keep, deadline)


def table(found: Sequence[tuple[Case | str, Figures]]) -> str:
    """All rows, and below them what could not be diagnosed."""
    rows = [row(case, kept) for case, kept in found if isinstance(case, Case) and "figures" in kept]
    refused: dict[str, str] = {}
    for case, kept in found:
        name = case if isinstance(case, str) else f"{case.recording} {' '.join(case.trials or ())}".strip()
        if "refused" in kept:
            refused[f"- `{name}`: {kept['refused']}"] = name
    return "\n".join([HEAD, *rows, "", "Not diagnosed:", "", *(refused or ["none"])])


def main() -> None:
    """Make what is missing, and put the table into the page."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.findings", description=__doc__)
    arguments.add_argument("--only", default="", help="part of a recording's name; the page is not written")
    arguments.add_argument("--keep", type=Path, default=KEPT, help="where answers are kept")
    arguments.add_argument("--minutes", type=float, default=60.0, help="CPU time after which none is begun")
    chosen = arguments.parse_args()
    chosen.keep.mkdir(parents=True, exist_ok=True)
    found = []
    for case, kept in answers(chosen.only, chosen.keep, 60 * chosen.minutes):
        found.append((case, kept))
        print(case.key if isinstance(case, Case) else case, kept.get("refused", ""), flush=True)
    if chosen.only:
        print(table(found))
        return
    write_section(PAGE, "findings", table(found))


if __name__ == "__main__":
    main()
