"""What a diagnosis costs beyond its fit: CPU seconds and memory of the search, without direct checks."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from benchmarks.markdown import table
from benchmarks.recordings import data_folder
from benchmarks.speed.measuring import cpu_seconds, peak_megabytes
from solver.capture.subject.opened_subject import open_subject
from solver.common.progress import silent
from solver.diagnosis.diagnose_subject import answer_balance, repaired_balance
from solver.fitting.settings import settings_for

RECORDINGS = (
    "opencap_subject4",
    "opencap_subject6",
    "walk_rajagopal2015",
    "run_treadmill_hamner2013_subject04",
    "overground_camargo2021_AB06",
    "exo_apo_gordon",
    "walk_treadmill_stepwidth",
)


def section(only: str) -> str:
    """Each recording in a process of its own, so that the peak of memory is its own."""
    rows = []
    for name in RECORDINGS:
        if only in name:
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
                rows.append([name, *pool.submit(_row, data_folder() / name).result()])
            print(rows[-1], flush=True)
    return table(["recording", "rows", "fit [s]", "search [s]", "peak [MB]", "named"], rows)


def _row(folder: Path) -> list[object]:
    settings = settings_for(folder)
    subject = open_subject(folder)
    (balance, seen, _), fit_s = cpu_seconds(
        lambda: repaired_balance(subject, settings, trials=None, reviews={}, progress=silent)
    )
    diagnosis, search_s = cpu_seconds(lambda: answer_balance(balance, seen))
    peak_MB = peak_megabytes()
    named = ", ".join(effect.id for effect in diagnosis.effects) or "nothing"
    rows = sum(len(trial.residual) for trial in balance.trials)
    return [rows, f"{fit_s:.1f}", f"{search_s:.1f}", f"{peak_MB:.0f}", named]
