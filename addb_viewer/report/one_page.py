"""The form on one A4 page: subject, verdict, usable frames, residuals, causes, who reviewed; for a folder."""

from collections.abc import Sequence

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.frames_kept import Kept, in_all
from addb_viewer.report.key_findings import bounds_of, frames_sentence, reasons, strip, verdict_kind
from addb_viewer.report.made_from import person_rows
from addb_viewer.report.markup import Safe, element, joined
from addb_viewer.report.report_page import page_html
from addb_viewer.text.diagnosis_vocabulary import amounts, short_title, sureness, tentative_of
from addb_viewer.text.judged_figures import SOURCE, Judged, judged_figures
from addb_viewer.text.use_words import use
from addb_viewer.text.verdict_words import headline
from addb_viewer.trial_view.recorded_subject import TrialRecord
from annotations.events import IMPORTED, Status
from annotations.folding import folded
from solver.contact.wrenches import DETECTION, FILE, NOBODY, PERSON

MOST_TRIALS, MOST_CAUSES, MOST_AMOUNTS = 12, 4, 2  # that fit on the page
FEW_TRIALS = 3  # whose figures beyond a bound are told one by one
DECIDED = {
    PERSON: "a person",
    FILE: "an imported review",
    DETECTION: "detection, unconfirmed",
    NOBODY: "nobody",
}


def one_page(report: SubjectReport) -> str:
    """The form's HTML; of many trials it has the worst, and what holds for all."""
    recording = report.recording
    version = recording.fit.provenance.get("addb-viewer", "")
    person = [f"{label.lower()} {value}" for label, value in person_rows(recording.fit)]
    body = element(
        "main",
        element(
            "div",
            element("h1", recording.subject),
            element("p", f"{report.made:%Y-%m-%d %H:%M} · addb-viewer {version}"),
            class_="top",
        ),
        element("p", " · ".join(person), class_="person"),
        _answers(report),
        element("h2", "Trials"),
        *_trials(report),
        element("h2", "Causes that the diagnosis names"),
        _causes(report),
        element("h2", "Reviewed"),
        *(element("p", line) for line in _reviewed(report)),
        element(
            "p",
            f"Bounds of {SOURCE}; RMS over the frames that count. The report has the rest.",
            class_="fine",
        ),
        element(
            "div", *(element("span", word) for word in ("checked by", "date", "signature")), class_="signed"
        ),
        class_="form",
    )
    return page_html(
        f"{recording.subject} — addb-viewer, one page", body, styles=("report.css", "one_page.css")
    )


def _answers(report: SubjectReport) -> Safe:
    bounds, figures = bounds_of(report), report.diagnosis.figures
    count, frames = in_all(report.kept)
    whole = "good" if count == frames else "doubt" if count else "bad"
    (kind, _), head = verdict_kind(figures)
    told = [report.diagnosis.absent] if figures is None else [headline(figures), use(figures)]
    few = len(report.kept) <= FEW_TRIALS
    beyond = bounds.beyond if few else ("The last row below says in how many trials each is met.",)
    met = "good" if bounds.judged and not bounds.beyond else "bad" if bounds.beyond else "plain"
    why = reasons(report.kept)
    return element(
        "div",
        _answer(whole, frames_sentence(report.kept), why),
        _answer(met, bounds.words, [*beyond, *(f"{label}: not computed" for label in bounds.unknown if few)]),
        _answer(kind, head, told),
        class_="answers",
    )


def _answer(kind: str, head: str, lines: Sequence[str]) -> Safe:
    return element("div", element("b", head), *(element("p", line) for line in lines), class_=kind)


def _trials(report: SubjectReport) -> list[Safe]:
    """A row for each trial, the worst first; of many those alone, and below them all together."""
    rows = list(zip(report.recording.trials, report.kept, strict=True))
    rows.sort(key=_badness, reverse=True)
    judged = judged_figures(rows[0][0].figures)
    heads = [
        "Trial",
        "Usable frames",
        *(joined((j.label, element("small", f"bound {j.bound}"))) for j in judged),
    ]
    shown = rows[:MOST_TRIALS]
    body = [
        element("tr", element("th", record.replay.name, scope="row"), *_cells(record, kept))
        for record, kept in shown
    ]
    if len(rows) > 1:
        body.append(_total(report, len(rows)))
    head = element("tr", *(element("th", cell, scope="col") for cell in (*heads, "Who decided")))
    drawn = [element("table", element("thead", head), element("tbody", *body), class_="trials")]
    if len(rows) > len(shown):
        words = (
            f"The {len(shown)} worst of {len(rows)} trials, by residual and marker error in units of their "
            "bounds, then by frames left out."
        )
        drawn.insert(0, element("p", words))
    return drawn


def _badness(row: tuple[TrialRecord, Kept]) -> tuple[float, float]:
    record, kept = row
    shares = [judged.share for judged in judged_figures(record.figures) if judged.share is not None]
    return max(shares, default=0.0), 1 - kept.count / max(kept.frames, 1)


def _cells(record: TrialRecord, kept: Kept) -> list[Safe]:
    usable = joined((f"{kept.count} of {kept.frames}", strip(kept)))
    sources = record.figures.mask_source.split(" + ")
    who = ", ".join(DECIDED.get(source, source) for source in sources)
    return [
        element("td", usable),
        *map(_figure, judged_figures(record.figures)),
        element("td", who, title=who),
    ]


def _figure(judged: Judged) -> Safe:
    if judged.within is None:
        return element("td", "–", title="not computed")
    value = f"{judged.value} {'✓' if judged.within else '✗'}"
    return element("td", value, class_="within" if judged.within else "beyond")


def _total(report: SubjectReport, trials: int) -> Safe:
    """All trials: their frames, and how many are within each bound."""
    count, frames = in_all(report.kept)
    columns = zip(*(judged_figures(record.figures) for record in report.recording.trials), strict=True)
    told = []
    for column in columns:
        known = [judged.within for judged in column if judged.within is not None]
        told.append(f"{sum(known)} of {len(known)} ✓" if known else "–")
    cells = [f"{count} of {frames}", *told, ""]
    return element(
        "tr",
        element("th", f"all {trials} trials", scope="row"),
        *(element("td", c) for c in cells),
        class_="total",
    )


def _causes(report: SubjectReport) -> Safe:
    figures = report.diagnosis.figures
    if figures is None or not figures.effects:
        none = "No diagnosis is kept." if figures is None else "None."
        return element("p", none)
    leads, rows = tentative_of(figures), []
    for effect in figures.effects[:MOST_CAUSES]:
        lead = ", tentative" if any(effect is one for one in leads) else ""
        standing = report.diagnosis.standings.get((effect.id, effect.target))
        decided = (
            "nobody yet"
            if standing is None
            else f"{standing.kind}ed by {standing.by}, {standing.when:%Y-%m-%d}"
        )
        cells = ("; ".join(amounts(effect)[:MOST_AMOUNTS]), f"{sureness(effect.confidence)}{lead}", decided)
        rows.append(
            element("tr", element("th", short_title(effect), scope="row"), *(element("td", c) for c in cells))
        )
    more = len(figures.effects) - MOST_CAUSES
    if more > 0:
        rows.append(
            element(
                "tr", element("th", f"and {more} more", scope="row"), *(element("td", "") for _ in range(3))
            )
        )
    head = element(
        "tr", *(element("th", words, scope="col") for words in ("Cause", "How large", "Sure", "Decided"))
    )
    return element("table", element("thead", head), element("tbody", *rows), class_="causes")


def _reviewed(report: SubjectReport) -> list[str]:
    """Who finished which trials, who else edited, and how many nobody has looked at."""
    recording = report.recording
    by_person: dict[str, list[int]] = {}
    untouched = 0
    for record in recording.trials:
        name = record.replay.name
        edits = [edit for edit in recording.edits if edit.trial == name]
        people = dict.fromkeys(edit.author for edit in edits if edit.author != IMPORTED)
        untouched += not people
        review = folded(name, edits, recording.fit.subject.foot_bodies)
        for person in people:
            edited_finished = by_person.setdefault(person, [0, 0])
            edited_finished[0] += 1
            edited_finished[1] += review.status_author == person and review.status is Status.FINISHED
    all_ = len(recording.trials)
    lines = [
        f"{person}: edited {edited}, finished {finished} of {all_} trial{'s' if all_ > 1 else ''}."
        for person, (edited, finished) in sorted(by_person.items(), key=lambda item: -item[1][0])
    ]
    if untouched:
        what = "it" if all_ == 1 else "any trial" if untouched == all_ else f"{untouched} of the trials"
        lines.append(f"Nobody has reviewed {what} yet.")
    return lines
