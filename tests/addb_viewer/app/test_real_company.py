"""Two people at real walks: names, trials, disagreements and solves; and what a terminal does meanwhile."""

import html as pages
import shutil

import pytest

from addb_viewer.app.app import start
from addb_viewer.jobs.stored_solves import stored_solves
from annotations.events import Status
from solver.capture.subject.subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.results.store import has_fit, save_fit
from solver.fitting.settings import Settings

pytestmark = [pytest.mark.real, pytest.mark.timeout(900)]

CARRIED = (8, 76)  # frames of `part1` on which no plate carries the left foot: detection leaves them out


def paint(browser, frames, label):
    browser.put("Go to", "")
    browser.put("Go to", "{}:{}".format(*frames))
    browser.until(lambda: browser.session.review.chosen == frames, frames)
    browser.press(label)


def states(walks_folder):
    return [(solve.by, solve.state) for solve in stored_solves(walks_folder / "results")]


def table(browser):
    return browser.session.queue.table.content


@pytest.mark.slow
def test_every_browser_is_asked_for_a_name_once_and_edits_are_under_it(walks_app, enter, walks_review):
    ada, bo = enter(walks_app, name=None), enter(walks_app, name=None)
    at = {browser: browser.session.shown for browser in (ada, bo)}
    for browser, name in ((ada, "Ada"), (bo, "Bo")):
        paint(browser, (30, 40), "Flag: force wrong")
        browser.until(lambda browser=browser: browser.asked("Who is reviewing?"), "the question")
        browser.put("Your name", name)
        browser.click("Decide under this name")
        browser.until(lambda browser=browser: not browser.questions, "the answer")
    ada.until(lambda: [[f.author for f in walks_review(at[b]).flags] for b in (ada, bo)] == [["Ada"], ["Bo"]])
    ada.put("Trial", at[bo])
    ada.until(lambda: ada.session.shown == at[bo])
    ada.press("Undo")
    ada.until(lambda: ada.told("nothing of Ada's to undo"))
    assert [f.author for f in walks_review(at[bo]).flags] == ["Bo"]
    paint(ada, (50, 60), "Flag: force wrong")
    ada.until(lambda: [f.author for f in walks_review(at[bo]).flags] == ["Bo", "Ada"])
    assert not ada.questions, "asked once"


def test_a_trial_is_offered_to_one_person_and_both_see_who_is_where(walks_app, enter, walks_review):
    zoe, bo = enter(walks_app), enter(walks_app, name="Bo")
    assert {zoe.session.shown, bo.session.shown} == {"part1", "part2"}
    zoe.until(lambda: "Bo is here" in table(zoe), "the queue")
    bo.until(lambda: "Zoë is here" in table(bo), "the queue")
    here = zoe.session.shown
    zoe.finish()
    zoe.until(lambda: walks_review(here).status is Status.FINISHED)
    zoe.until(lambda: zoe.told(f"Bo on {bo.session.shown}"), "where Bo is")
    assert zoe.session.shown == here


def test_both_hear_of_a_disagreement_and_finishing_over_it_says_so(walks_app, enter, walks_review):
    zoe, bo = enter(walks_app, at="part1"), enter(walks_app, name="Bo", at="part1")
    zoe.until(lambda: "Bo is on this trial too" in zoe.html(), "who is here")
    paint(zoe, (30, 50), "Flag: force wrong")
    bo.until(lambda: "30–49" in bo.html())
    paint(bo, (40, 60), "Clear: the force counts")
    said = "Zoë says 'force wrong', Bo says 'the force counts'; the later one, Bo's, counts"
    for browser, other in ((zoe, "Bo"), (bo, "Zoë")):
        browser.until(lambda b=browser, o=other: b.told(f"You and {o} disagree"), "the disagreement")
        browser.until(lambda b=browser: b.told(said) and said in pages.unescape(b.html()), "its words")
    zoe.press("Finish the trial, go to the next")
    zoe.until(
        lambda: zoe.told(f"Two people disagree about frames 40 to 49: {said}"), "what speaks against it"
    )
    assert walks_review().status is Status.IN_WORK


@pytest.mark.slow
def test_solves_take_turns_and_anothers_is_discarded_after_a_question_only_and_told(
    walks_folder, walks_app, enter, walks_review
):
    zoe, bo = enter(walks_app, at="part1"), enter(walks_app, name="Bo", at="part2")
    paint(zoe, CARRIED, "Clear: the force counts")
    zoe.until(lambda: walks_review().cleared)
    zoe.press("Solve again")
    bo.until(lambda: "Solving for Zoë" in bo.html(), "what is at work")
    bo.press("Solve again")
    bo.until(lambda: bo.told("It waits its turn"), "the turn")
    zoe.until(lambda: [by for by, _ in states(walks_folder)][-2:] == ["Zoë", "Bo"], "both solves")
    for browser in (zoe, bo):
        browser.until(lambda b=browser: "· for Zoë" in b.html(), "the banner")
        browser.until(lambda b=browser: "New solve of Zoë and of Bo waits" in table(b), "the queue")
    bo.press("Discard the new solve")
    bo.until(lambda: bo.asked("Discard Zoë's solve"), "the question")
    assert ("Zoë", "new") in states(walks_folder)
    bo.press("Yes, to the question")
    zoe.until(lambda: zoe.told("Bo has discarded your solve"))
    zoe.until(lambda: states(walks_folder)[-2:] == [("Zoë", "discarded"), ("Bo", "new")])


@pytest.mark.slow
def test_a_first_fit_is_awaited_made_and_kept_without_asking(walks_folder, enter):
    shutil.rmtree(walks_folder / "results")
    app = start(walks_folder, port=0)
    try:
        zoe, bo = enter(app, at="part1"), enter(app, name="Bo", at="part2")
        for browser in (zoe, bo):
            browser.until(lambda b=browser: "No fit yet" in b.html(), "the banner")
            browser.until(lambda b=browser: "no fit" in table(b), "the queue")
        zoe.press("Solve again")
        for browser in (zoe, bo):
            browser.until(lambda b=browser: "Solving for Zoë" in table(b), "the queue")
        for browser in (zoe, bo):
            browser.until(lambda b=browser: b.told("The subject's first fit is kept"), "the word")
            browser.until(lambda b=browser: "no fit" not in table(b), "the queue")
            browser.until(lambda b=browser: b.session.replay.bodies is not None, "the skeleton")
        assert has_fit(walks_folder / "results")
        assert states(walks_folder) == [("Zoë", "kept")]
        assert not zoe.questions
    finally:
        app.close()


def test_a_fit_made_in_a_terminal_shows_in_the_rows_of_other_subjects(two_walks, tmp_path, enter):
    root = tmp_path / "root"
    for name in ("S1", "S2"):
        shutil.copytree(two_walks, root / name)
    shutil.rmtree(root / "S2" / "results")
    app = start(root, port=0)
    try:
        zoe = enter(app, trial=False)
        zoe.until(lambda: zoe.session.replay is not None)
        zoe.session.notices.do("Going to the other subject", lambda: zoe.session.open("S1", "part1"))
        zoe.until(lambda: zoe.session.shared.name == "S1")
        zoe.put("Filter", "S2")
        zoe.until(lambda: table(zoe).count("no fit") == 2, "the rows")
        save_fit(solve(open_subject(root / "S2"), Settings()), root / "S2" / "results")
        zoe.until(lambda: "no fit" not in table(zoe), "the figures")
        assert zoe.session.shared.name == "S1"
    finally:
        app.close()
