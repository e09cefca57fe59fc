"""A scripted reviewer on the real recording whose first and last steps found no plate."""

import shutil

import pytest

from addb_viewer.app.app import start
from addb_viewer.jobs.review_store import open_log
from annotations.events import Status
from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.results.store import save_fit
from solver.fitting.settings import settings_for
from tests.addb_viewer.app.ten_trials import NO_HELD_OUT
from tests.patience import PATIENCE_S

FEET = ("calcn_r", "calcn_l")
MOST_KEYS = 30

# Steps that no plate measured, by the data's README, which has them from foot markers and plates alone [s]
UNMEASURED = {"calcn_r": ((0.01, 0.09), (1.72, 2.15), (2.73, 2.81)), "calcn_l": ((0.16, 0.61), (2.24, 2.68))}
START_S, RATE_HZ = 0.01, 100.0


@pytest.fixture(scope="module")
def folder(real_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("real") / "falisse"
    shutil.copytree(real_data / "overground_falisse_AdDB", folder)
    (folder / "settings.toml").write_text(NO_HELD_OUT)
    save_fit(solve(open_subject(folder), settings_for(folder)), folder / "results")
    return folder


@pytest.mark.slow
def test_proposals_accepted_by_key_finish_the_trial(folder, enter):
    app = start(folder, port=0)
    try:
        browser = enter(app)
        session, keys = browser.session, 0

        def press(label, until, awaited):
            """An edit is in the log before the same hand goes on to the next proposal: wait for both."""
            nonlocal keys
            keys += 1
            browser.press(label)
            browser.until(until, awaited)
            session.notices._hand.submit(lambda: None).result(PATIENCE_S)

        press("Next proposal or flagged range", lambda: session.review.current, "the first proposal")
        while session.review.current is not None and keys < MOST_KEYS:
            decided = _decided(folder)
            press("Accept the proposal", lambda decided=decided: _decided(folder) > decided, "the decision")
        assert "G solves again" not in browser.html(), "what was accepted did not count before either"
        press("Solve again", lambda: browser.told("Nothing to solve"), "no solve")
        assert not session.shared.jobs.process.running
        press(
            "Finish the trial, go to the next", lambda: _review(folder).status is Status.FINISHED, "the end"
        )
    finally:
        app.close()
    assert keys < MOST_KEYS
    review = _review(folder)
    for foot, steps in UNMEASURED.items():
        flagged = {
            frame
            for start_, end, of_foot, _ in review.missing_ranges
            if of_foot in (None, foot)
            for frame in range(start_, end)
        }
        for step in steps:
            first, last = (round((t - START_S) * RATE_HZ) for t in step)
            assert set(range(first, last + 1)) <= flagged, (foot, step)


def _review(folder):
    with open_log(folder) as log:
        return log.review("Gait_7", FEET)


def _decided(folder):
    with open_log(folder) as log:
        return len(log.history("Gait_7"))
