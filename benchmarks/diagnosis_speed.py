"""`python -m benchmarks.diagnosis_speed fit|search|compare`: what a diagnosis costs beyond its fit.

A case's fit is made once and kept; searches in it are kept under a label each, with their answers. What is
there already is not made again, so that a run that was stopped goes on where it was. `compare` says every
difference of two labels' answers, with CPU seconds, memory and evaluations side by side. The peak is the most
that the process held so far: of one case where it alone is searched (`--only`).
"""

import argparse
import json
import pickle
import resource
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from benchmarks.recordings import data_folder
from solver.capture.atomic import whole_file, write_whole
from solver.capture.subject.subject import open_subject
from solver.common.progress import silent
from solver.diagnosis.diagnose import answer_balance, repaired_balance
from solver.diagnosis.marker_causes import SeenInMarkers
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.noise.rows import TrialRows
from solver.diagnosis.report import as_json
from solver.diagnosis.search import refinement
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.screening import Beside
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.fitting.settings import settings_for

REAL = (
    "opencap_subject4",
    "opencap_subject6",
    "walk_rajagopal2015",
    "run_treadmill_hamner2013_subject04",
    "overground_camargo2021_AB06",
    "exo_apo_gordon",
    "walk_treadmill_stepwidth",
)
SAME_NATS = 0.2  # of evidence: what a search over η leaves to the derivatives
SAME_SHARE = 0.01  # of a confidence; of a parameter, or of its standard deviation where that is larger


@dataclass(frozen=True, eq=False)
class Fitted:
    """All that a search needs of a case, and what making it took; no direct check is asked."""

    trials: tuple[TrialRows, ...]
    settings: DiagnosisSettings
    seen: SeenInMarkers
    seconds_cpu: float


def fit_case(folder: Path) -> Fitted:
    """The markers alone, repaired, and the balance's rows."""
    settings = settings_for(folder)
    began = time.process_time()
    subject = open_subject(folder)
    balance, seen, _ = repaired_balance(subject, settings, trials=None, reviews={}, progress=silent)
    return Fitted(balance.trials, balance.settings, seen, time.process_time() - began)


def search_case(case: Fitted) -> dict[str, Any]:
    """CPU seconds, evaluations and the answer of one search."""
    with counted() as counts:
        began = time.process_time()
        diagnosis = answer_balance(Balance(case.trials, case.settings), case.seen)
        seconds = time.process_time() - began
    return {
        "peak_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,  # of the process so far
        "rows": sum(len(t.residual) for t in case.trials),
        "fit_seconds_cpu": case.seconds_cpu,
        "search_seconds_cpu": seconds,
        "evaluations": dict(counts),
        "diagnosis": as_json(diagnosis),
    }


@contextmanager
def counted() -> Iterator[Counter[str]]:
    """Counts rows made of a cause, small systems solved, searches over η, and K factored, meanwhile."""
    counts: Counter[str] = Counter()

    def counting(of: Any, name: str, what: str) -> Any:
        whole = getattr(of, name)

        def once(*args: Any) -> Any:
            found = whole(*args)
            counts[what] += len(found) if isinstance(found, list) else 1
            return found

        return patch.object(of, name, once)

    constant = NoiseScale.constant.func  # type: ignore[attr-defined]

    def factored(noise_scale: NoiseScale) -> Any:
        counts["factors of K"] += 1
        return constant(noise_scale)

    with ExitStack() as stack:
        stack.enter_context(counting(Balance, "rows_of", "rows of causes"))
        stack.enter_context(counting(Balance, "solve_at", "sets fitted"))
        stack.enter_context(counting(Beside, "gains", "gains beside others"))
        stack.enter_context(counting(refinement.Climb, "best", "searches over η"))
        stack.enter_context(patch.object(NoiseScale.constant, "func", factored))
        yield counts


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """What is not the same in two answers, in words."""
    found = []
    if before["verdict"] != after["verdict"]:
        found.append(f"verdict {before['verdict']} → {after['verdict']}")
    old, new = ({(e["id"], e["target"]): e for e in d["effects"]} for d in (before, after))
    found += [f"no longer named: {' '.join(key)}" for key in old if key not in new]
    found += [f"newly named: {' '.join(key)}" for key in new if key not in old]
    more = after["evidence_nats"] - before["evidence_nats"]
    if abs(more) > SAME_NATS:
        found.append(f"evidence {before['evidence_nats']:.1f} nats {more:+.1f}")
    for key in old:
        if key in new:
            found += [f"{' '.join(key)}: {text}" for text in _of_one(old[key], new[key])]
    rivals = [[(a["id"], a["target"]) for a in d["alternatives"]] for d in (before, after)]
    if rivals[0] != rivals[1]:
        found.append(f"could also be {rivals[0]} → {rivals[1]}")
    places = [(d["remaining"]["location"] or {}).get("body") for d in (before, after)]
    if places[0] != places[1]:
        found.append(f"left over at {places[0]} → {places[1]}")
    outside = [(d["remaining"]["off_the_list"] or {}).get("sentence") for d in (before, after)]
    if outside[0] != outside[1]:
        found.append(f"off the list {outside[0]} → {outside[1]}")
    return found


def _of_one(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Likewise of one named cause."""
    found = []
    if abs(after["confidence"] - before["confidence"]) > SAME_SHARE:
        found.append(f"confidence {before['confidence']:.3f} → {after['confidence']:.3f}")
    for name, old in before["parameters"].items():
        new = after["parameters"].get(name)
        if new is None or old["value"] is None or new["value"] is None:
            if old != new:
                found.append(f"{name} {old} → {new}")
        elif abs(new["value"] - old["value"]) > max(
            0.1 * (old["std"] or 0.0), SAME_SHARE * abs(old["value"])
        ):
            found.append(f"{name} {old['value']:.4g} ± {old['std'] or 0:.2g} → {new['value']:.4g}")
    return found


def table(out: Path, labels: tuple[str, str]) -> str:
    """CPU and evaluations of two labels, and every difference of their answers."""
    lines = [
        f"| case | rows | fit [s] | search [s] {labels[0]} → {labels[1]} | peak [MB] | evaluations | answer |"
    ]
    lines.append("|---|---|---|---|---|---|---|")
    for path in sorted((out / labels[0]).glob("*.json")):
        other = out / labels[1] / path.name
        if not other.exists():
            continue
        before, after = (json.loads(p.read_text(encoding="utf-8")) for p in (path, other))
        seconds = " → ".join(f"{d['search_seconds_cpu']:.1f}" for d in (before, after))
        peaks = " → ".join(f"{d['peak_MB']:.0f}" for d in (before, after))
        counts = "; ".join(
            f"{what} {before['evaluations'].get(what, 0)} → {after['evaluations'].get(what, 0)}"
            for what in sorted({*before["evaluations"], *after["evaluations"]})
        )
        apart = "; ".join(differences(before["diagnosis"], after["diagnosis"])) or "the same"
        fit = f"{before['fit_seconds_cpu']:.1f}"
        row = (path.stem, str(before["rows"]), fit, seconds, peaks, counts, apart)
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def main() -> None:
    """Parse and do."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.diagnosis_speed", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    fitting = commands.add_parser("fit", help="fit every case that is not fitted yet")
    fitting.add_argument("--made", type=Path, help="as `python -m benchmarks.diagnosis make` wrote it")
    searching = commands.add_parser("search", help="search in every case that has no answer yet")
    searching.add_argument("label")
    searching.add_argument("--only", default="", help="part of a case's name")
    comparing = commands.add_parser("compare", help="print the table")
    comparing.add_argument("labels", nargs=2)
    for command in (fitting, searching, comparing):
        command.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    if given.command == "fit":
        fit_all(given.out, given.made)
    elif given.command == "search":
        search_all(given.out, given.label, given.only)
    else:
        print(table(given.out, tuple(given.labels)))


def fit_all(out: Path, made: Path | None) -> None:
    """The real cases, and made ones."""
    folders = [data_folder() / name for name in REAL]
    folders += sorted((made / "subjects").iterdir()) if made else []
    (out / "fits").mkdir(parents=True, exist_ok=True)
    for folder in folders:
        kept = out / "fits" / f"{folder.name}.pickle"
        if not kept.exists():
            case = fit_case(folder)
            with whole_file(kept) as file:
                pickle.dump(case, file)
            print(f"{folder.name}: fitted in {case.seconds_cpu:.1f} s", flush=True)


def search_all(out: Path, label: str, only: str) -> None:
    """Every fitted case."""
    (out / label).mkdir(exist_ok=True)
    for kept in sorted((out / "fits").glob("*.pickle")):
        answer = out / label / f"{kept.stem}.json"
        if only in kept.stem and not answer.exists():
            found = search_case(pickle.loads(kept.read_bytes()))
            write_whole(answer, json.dumps(found, indent=1) + "\n")
            names = [f"{e['id']} {e['target']}" for e in found["diagnosis"]["effects"]]
            print(
                f"{kept.stem}: {found['search_seconds_cpu']:.1f} s; {', '.join(names) or 'nothing'}",
                flush=True,
            )


if __name__ == "__main__":
    main()
