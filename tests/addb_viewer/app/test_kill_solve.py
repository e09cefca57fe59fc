"""Killed while a solve runs or is written: what is shown is whole, and the present fit stays."""

import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from addb_viewer.app.subjects.library import library_of
from addb_viewer.app.subjects.shared_subject import SharedSubject
from addb_viewer.jobs.stored_solves import KEPT, NEW, stored_solves
from solver.capture.subject.opened_subject import open_subject
from solver.fitting.results.store import load_fit, save_fit
from tests.addb_viewer.app.paper_browser import PaperBrowser
from tests.addb_viewer.app.test_kill import serving

ROUNDS, LONGEST_S = 3, 0.4
RUNNING = (0.1, 3.5)  # [s] after G; the solve takes about three

WRITER = """
import sys
from dataclasses import replace
from pathlib import Path
from addb_viewer.jobs.stored_solves import add, keep, stored_solves
from solver.fitting.results.store import load_fit

folder, results, keeping = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3] == "keep"
fit = load_fit(results, folder)
while True:
    number = add(replace(fit, mass_kg=fit.mass_kg + 1), results, by="Zoë", seconds=1.0)
    if keeping:
        keep(next(s for s in stored_solves(results) if s.number == number), results, folder)
    print(number, flush=True)
"""


def killed(writer, rng):
    """Ended at a random moment after its first solve; returns the last number that it said."""
    try:
        first = writer.stdout.readline()
        time.sleep(rng.uniform(0.0, LONGEST_S))
    finally:
        writer.send_signal(signal.SIGKILL)
        said = [first, *writer.communicate()[0].splitlines()]
    return int(said[-1])


@pytest.mark.slow
@pytest.mark.parametrize("doing", ["add", "keep"])
def test_what_is_shown_is_whole_and_the_fit_stays(small_fit, doing):
    folder, rng = small_fit.subject.folder, np.random.default_rng(0)
    results = folder / "results"
    save_fit(small_fit, results)
    before = (results / "fit.json").read_bytes()
    for _ in range(ROUNDS):
        command = [sys.executable, "-c", WRITER, str(folder), str(results), doing]
        last = killed(subprocess.Popen(command, stdout=subprocess.PIPE, text=True), rng)
        made = stored_solves(results)
        assert last in [solve.number for solve in made]
        assert sum(solve.state == KEPT for solve in made) <= 1
        for solve in made:
            fit = load_fit(solve.folder, folder)
            assert solve.figures.subject.mass_kg == fit.mass_kg
        kept = load_fit(results, folder)
        if doing == "add":
            assert (results / "fit.json").read_bytes() == before
        else:  # the solve that was being kept, or the one before
            assert kept.mass_kg in [load_fit(s.folder, folder).mass_kg for s in made[-2:]]


@pytest.mark.slow
def test_a_solve_killed_with_its_app_leaves_the_fit_and_a_sound_history(fitted_squat, tmp_path):
    subject = shutil.copytree(fitted_squat, tmp_path / "S1")
    rng, results = np.random.default_rng(0), subject / "results"
    before = (results / "fit.json").read_bytes()
    for k in range(2):
        process, port = serving(subject)
        browser = PaperBrowser(port)
        try:
            browser.until(lambda browser=browser: "data-addb-curves" in browser.html(), "a trial")
            note = f"so that there is something to solve, {k}"
            browser.put("Note", note)
            start = 150 + 10 * k
            browser.select(start, start + 5)
            browser.press_in_palette("Flag: other")
            browser.until(lambda browser=browser, note=note: f"({note})" in browser.html(), note)
            browser.press("Solve again")
            browser.until(lambda browser=browser: browser.bar["work"], "the solve")
            time.sleep(rng.uniform(*RUNNING))
        finally:
            os.killpg(process.pid, signal.SIGKILL)  # the app and its worker, as the power going off
            process.communicate()
            browser.close()
        assert (results / "fit.json").read_bytes() == before
        for solve in stored_solves(results):
            assert load_fit(solve.folder, subject).trials[0].motion.frames > 0
        shown = SharedSubject(".", library_of(open_subject(subject)))
        try:
            waiting = [s.number for s in stored_solves(results) if s.state == NEW]
            assert (shown.fits.new.number if shown.fits.new else None) == (waiting[-1] if waiting else None)
            assert shown.fits.shown.replay("squat").bodies is not None
        finally:
            shown.close()
