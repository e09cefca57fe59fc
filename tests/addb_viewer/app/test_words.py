"""What a page of the app says, in all its tabs, lanes, notices and questions, is in a reviewer's words."""

import html
import re
from dataclasses import replace

import pytest

from addb_viewer.jobs.review_store import open_log
from addb_viewer.text.evidence_words import plain
from addb_viewer.text.plain_words import in_plain_words
from annotations.activities import ACTIVITIES, activity_words
from annotations.events import AcceptProposal, FlagRange, ImportLabels, Proposal, SetActivity
from annotations.reasons import REASONS
from annotations.suggested_activity import SuggestedActivity
from solver.common.notes import Kind, noted
from solver.contact.detected_ranges import Proposal as Detected

NOT_SAID = {
    "a body as models name it": r"\b(calcn|tibia|femur|talus|toes)_[rl]\b",
    "a coordinate as models name it": r"\b(\w+_(angle|flexion|rotation)_[rl]|pelvis_t[xyz])\b",
    "a reason as a format names it": "|".join(REASONS),
    "odds": r"log[ _]odds",
    "an exponent": r"\d[eE][+-]\d",
    "a word twice": r"\b(\w+)( · | )\(?\1\b(?! jump)",
    "an end that is not included": r"\b(60|20|100|120):(80|30|110|140)\b",
}
RANGES = ((60, 80), (20, 30), (100, 110), (120, 140))  # of proposals and flags on the page
STEPS = (
    ("Next proposal or flagged range", (20, 30)),
    ("Accept the proposal", (60, 80)),
    ("Reject the proposal", (100, 110)),
)


def said(browser):
    """All that stands on the page and was told, as text."""
    with browser._heard:
        words = [str(v) for p in browser.gui.values() for v in p.values() if isinstance(v, str)]
        words += [str(option) for p in browser.gui.values() for option in p.get("options") or ()]
        words += [f"{title}\n{body}" for title, body in browser.notices]
        words += [*browser.questions, *browser.commands]
    text = re.sub(r"<style.*?</style>|<svg.*?</svg>", " ", "\n".join(words), flags=re.S)
    titles = re.findall(r"title='([^']*)'", text)  # lanes say their words when pointed at
    return html.unescape("\n".join([re.sub(r"<[^>]*>", "\n", text), *titles]))


@pytest.fixture
def diagnosed(effect, figures):
    return figures(effect("fixed_force", "calcn_r", force_N=1023.0))


@pytest.fixture
def page(tmp_path, make_replay, make_app, enter, diagnosed):
    """A trial with all that may be said of one: proposals, flags of all kinds, a label, a diagnosis."""
    replay = make_replay()
    proposals = (
        *replay.forces.proposals,
        Detected((130, 150), "calcn_r", "forceDiscrepancy", 0.999, {"missing_N": 1023.4, "log_odds": 12.0}),
        Detected(
            (160, 170), "calcn_l", "copOutsideConvexFootError", 0.5, {"outside_m": 0.03, "shift_N": 1020.0}
        ),
    )
    object.__setattr__(replay, "forces", replace(replay.forces, proposals=proposals))
    off = noted(Kind.OTHER, "walk: calcn_l is off its plate on frames 3 to 9")
    object.__setattr__(replay, "notes", off)
    object.__setattr__(replay, "suggested", (SuggestedActivity(0, 90, "jump", "drop jump", 0.9),))
    app = make_app(tmp_path, [replay, make_replay("run", 180)])
    with open_log(tmp_path) as log:
        log.append("walk", ImportLabels(((150, 155),), 200, True), "imported")
        log.append("walk", FlagRange(120, 140, "footContactDetectedButNoForce", "calcn_l"), "Bo")
        log.append("walk", AcceptProposal(Proposal(170, 180, "forceDiscrepancy", "calcn_r", 0.9)), "Bo")
        log.append("walk", SetActivity(180, 190, "jump", "jump"), "Bo")
    browser = enter(app)
    browser.session.diagnosis.state = replace(browser.session.diagnosis.state, figures=diagnosed)
    browser.session.diagnosis.show()
    yield browser
    app.close()


def test_no_page_says_what_only_programs_say(page):
    told = [said(page)]
    for label, chosen in STEPS:
        page.press(label)
        page.until(lambda chosen=chosen: page.session.review.chosen == chosen, label)
        told.append(said(page))
    page.press("Undo")
    page.until(lambda: page.told("Undone"))
    for typed, words in (("130-149", "1023 N missing"), ("160–169", "shift 1020 N")):
        page.go_to(typed)
        page.until(lambda words=words: words in said(page), words)
        told.append(said(page))
    page.go_to("120-139")
    page.until(lambda: page.session.review.chosen == (120, 140))
    page.press("Flag: force wrong")
    page.until(lambda: page.told("Two people") or "You and Bo" in str(page.notices), "the disagreement")
    page.press("Finish the trial, go to the next")
    page.until(lambda: page.asked("Finish "))
    told.append(said(page))
    page.press("No, to the question")
    page.press("Keys")
    page.until(lambda: page.asked("Play or pause"))
    told.append(said(page))
    everything = "\n".join(told)
    for what, pattern in NOT_SAID.items():
        found = re.search(pattern, everything)
        assert found is None, f"{what}: …{everything[max(found.start() - 60, 0) : found.end() + 40]}…"
    for words in (
        "right foot",
        "foot contact but no force",
        "1023 N missing",
        "120–139",
        "drop jump",
        "% sure",
    ):
        assert words in everything
    for start, end in RANGES:
        assert not re.search(rf"\b{start}\s*(–|to|-)\s*{end}\b", everything), (
            "the end of a range is its last frame"
        )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("the right foot (calcn_r) slips", "the right foot slips"),
        ("calcn_l: forceDiscrepancy", "left foot: force wrong"),
        ("right thigh and left thigh (femur_r, femur_l)", "right thigh and left thigh"),
        ("knee_angle_r and pelvis_tx", "right knee angle and pelvis position x"),
        ("knee_angle_r_beta is the model's", "knee_angle_r_beta is the model's"),
    ],
)
def test_names_of_bodies_coordinates_and_reasons_become_words(text, words):
    assert in_plain_words(text) == words


@pytest.mark.parametrize(
    ("value", "words"),
    [(1023.4, "1023"), (1.02e6, "1020000"), (57.31, "57.3"), (0.041234, "0.0412"), (-2.0, "-2"), (0.0, "0")],
)
def test_figures_have_three_digits_and_no_exponent(value, words):
    assert plain(value) == words


def test_no_activity_has_a_word_twice():
    for activity, subclasses in ACTIVITIES.items():
        for subclass in (None, *subclasses):
            words = activity_words(activity, subclass).split()
            assert len(words) == len(set(words))
            assert activity in words
