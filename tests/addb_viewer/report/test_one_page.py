"""The form on one page: what it says, and that it is one page however much there is to say."""

import re
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial

import pytest

from addb_viewer.report.content import DiagnosisShown, SubjectReport
from addb_viewer.report.one_page import MOST_CAUSES, MOST_TRIALS, one_page
from addb_viewer.report.subject_page import write_report
from addb_viewer.trial_view.recorded_subject import recording_of
from annotations.events import Edit, FlagRange, SetStatus, Status
from solver.fitting.results.extension_log import Standing
from tests.patience import PATIENCE_MS

NOW = datetime(2026, 2, 3, 4, 5, tzinfo=UTC)


def words(page):
    return " ".join(re.sub("<[^>]*>", " ", page.split("<body>")[1]).split()).replace("\u00a0", " ")


def shown(figures, *effects):
    return DiagnosisShown(replace(figures, effects=effects or figures.effects))


@pytest.fixture
def many(make_fit, diagnosis):
    """Thirty trials with long names, of which the eighteenth is the worst, and six causes."""
    fit = make_fit(*(f"trial {k:02d} with a name of some length, as laboratories like" for k in range(30)))
    recording = recording_of(fit, diagnosis=diagnosis)
    trials = list(recording.trials)
    worst = trials[17].figures
    worst = replace(worst, marker_max_m=40.0, hicks=replace(worst.hicks, marker_max=False))
    trials[17] = replace(trials[17], figures=worst)
    cause = diagnosis.effects[0]
    effects = [cause, *(replace(cause, id="carried_mass", target=f"body_{k}_l") for k in range(5))]
    return SubjectReport(replace(recording, trials=tuple(trials)), shown(diagnosis, *effects))


def test_it_has_subject_verdict_frames_figures_and_causes(report):
    said = words(one_page(report))
    for part in (
        "Zoë",
        "mass 40.0 kg fitted",
        "34 of 40 frames are usable",
        "the foot stands where no plate is",
        "A fault in the recordings, with a named cause",
        "forces shifted in time against the markers",
        "the forces come 12 ± 2 ms too late",
        "98 %",
        "checked by",
    ):
        assert part in said


def test_a_cause_has_who_decided_about_it(report):
    standing = Standing("reject", "Ada", NOW)
    diagnosis = replace(report.diagnosis, standings={("clock_offset", "all"): standing})
    assert "rejected by Ada, 2026-02-03" in words(one_page(replace(report, diagnosis=diagnosis)))
    assert "nobody yet" in words(one_page(report))


def test_reviewers_are_named_with_what_they_finished(make_fit):
    edits = (
        Edit(1, "walk", "Ada", NOW, FlagRange(3, 6, "manualReview")),
        Edit(2, "walk", "Ben", NOW, FlagRange(3, 8, "manualReview")),
        Edit(3, "walk", "Ben", NOW, SetStatus(Status.FINISHED)),
        Edit(4, "run", "Ada", NOW, FlagRange(3, 6, "manualReview")),
    )
    recording = recording_of(make_fit("walk", "run", "jump"), edits=edits)
    said = words(one_page(SubjectReport(recording)))
    assert "Ada: edited 2, finished 0 of 3 trials." in said
    assert "Ben: edited 1, finished 1 of 3 trials." in said
    assert "Nobody has reviewed 1 of the trials yet." in said


def test_of_many_trials_the_worst_stand_there_and_the_totals(many):
    page = one_page(many)
    said, rows = words(page), re.findall(r'<th scope="row">([^<]*)', page)
    assert rows[0].startswith("trial 17")
    assert len(rows) == MOST_TRIALS + 1 + MOST_CAUSES + 1
    assert f"The {MOST_TRIALS} worst of 30 trials" in said
    assert "all 30 trials 1020 of 1200" in said
    assert "29 of 30 ✓" in said  # largest marker error
    assert f"and {6 - MOST_CAUSES} more" in said


def test_names_from_files_stay_text(make_fit):
    page = one_page(SubjectReport(recording_of(make_fit("<img src=x>"))))
    assert "<img" not in page
    assert "Nobody has reviewed it yet." in words(page)


@pytest.fixture
def printed(browser, tmp_path):
    """Prints a page; gives the PDF's bytes."""
    pages = []

    def print_(write, report):
        page = browser.new_page()
        pages.append(page)
        page.set_default_timeout(PATIENCE_MS)
        page.goto(write(report, tmp_path / "page.html").as_uri())
        return page.pdf(prefer_css_page_size=True)

    yield print_
    for page in pages:
        page.close()


def pages_of(pdf):
    return len(re.findall(rb"/Type\s*/Page\b", pdf))


@pytest.mark.browser
def test_it_is_one_page_however_much_there_is_to_say(printed, many, report):
    form = partial(write_report, page=one_page)
    assert pages_of(printed(form, many)) == 1
    assert pages_of(printed(form, report)) == 1


LONELY = """() => {
    const column = (element) => Math.floor(element.getClientRects()[0].left / COLUMN);
    const seen = (element) => (element.getClientRects()[0]?.height ?? 0) > 0;
    const all = [...document.querySelectorAll("main *")].filter(seen);
    const heading = (e) => /^H[234]$/.test(e.tagName);
    const content = (e) => !heading(e) && !e.querySelector("h2, h3, h4");
    const after = (e) => all.slice(all.indexOf(e) + 1).find((o) => !e.contains(o) && content(o));
    const headings = all.filter((e) => heading(e) && after(e));
    const alone = headings.filter((e) => column(e) !== column(after(e)));
    return [headings.length, alone.map((e) => `${e.textContent} in ${e.closest("section").id}`)];
}"""
AS_PAGES = """
    body { width: 680px; height: 990px; column-width: 680px; column-gap: 20px; column-fill: auto; }
    html { scrollbar-width: none; }
"""


@pytest.mark.browser
def test_no_heading_of_the_printed_report_is_alone(browser, make_fit, diagnosis, tmp_path):
    """Laid out in columns of a page's size, where the rules for breaks are those between pages."""
    recording = recording_of(make_fit("walk", "run", "jump"), diagnosis=diagnosis)
    file = write_report(SubjectReport(recording, shown(diagnosis)), tmp_path / "report.html")
    page = browser.new_page(viewport={"width": 794, "height": 990})
    page.emulate_media(media="print")
    page.goto(file.as_uri())
    page.add_style_tag(content=AS_PAGES)
    headings, alone = page.evaluate(LONELY.replace("COLUMN", "700"))
    page.close()
    assert headings > 20
    assert alone == []
