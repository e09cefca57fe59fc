"""Results as tables: Markdown, CSV and LaTeX; the paper's rows stand apart."""

import csv
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from addb_viewer.benchmark.averages import Average, average, by_person, compared, macro_f1
from addb_viewer.benchmark.results import Result
from addb_viewer.benchmark.scoring import PAPER, UNITS, Score

PAPER_ROWS: tuple[tuple[str, tuple[str, str, str, str]], ...] = (
    ("Analytical (paper)", ("2.79", "6.15", "2.77", "4.47")),
    ("MLP (paper)", ("1.29", "0.03", "1.33", "1.41")),
    ("GroundLinkNet on AddB (paper)", ("1.17", "0.07", "1.34", "1.40")),
    ("UnderPressure (own data)", ("> 5.74", "–", "–", "–")),
    ("GroundLinkNet (own data)", ("> 3.06", "–", "–", "–")),
    ("Trajectory optimization (own data)", ("≈ 1", "–", "–", "–")),
)
"""Name; ground reaction force, ground reaction moment, torque, acceleration of the centre of mass."""
PAPER_DIFFERENCES = (
    "other persons, other recordings, other activities: the paper tested about eight subjects of its own",
    "the paper shows skeletons whose inertias were fitted to the forces; so does --skeleton fitted",
    "the paper does not say whether forces are averaged over both feet; means over feet fit its table",
    "the paper's moments cannot all be about the foot's origin: predicting none errs there by some "
    "0.7 N·m/kg in walks, against 0.03 for the free moment",
    "the paper's line for the centre of mass's acceleration lacks gravity; here it is in",
)

Format = Literal["markdown", "csv", "latex"]
NAMES = {
    "com_acc": "CoM acc.",
    "torque": "Joint torque",
    "grm": "GRM (at foot)",
    "grf": "GRF",
    "grf_vertical": "GRF vertical",
    "grf_total": "GRF total",
    "free_moment": "Free moment",
    "free_moment_zero": "… of predicting none",
    "cop": "CoP",
    "share_right": "Share on the right",
    "phase": "Phase right",
    "coverage_50": "Coverage of 50 %",
    "coverage_80": "Coverage of 80 %",
    "coverage_95": "Coverage of 95 %",
    "interval_95": "Width of 95 %",
    "nll": "−log density",
}
BESIDE = ("grf_vertical", "grf_total", "free_moment", "free_moment_zero", "cop", "share_right", "phase")
BANDS = ("coverage_50", "coverage_80", "coverage_95", "interval_95", "nll")
BEST_BASELINE = "analytical, best by others"
JUDGES = (
    "Forces and moments are judged by the plates. The accelerations and torques that count as true come from "
    "a solver of the same family as the fit-from-… entries: there the table shows agreement, not error."
)
JUDGED = "grf"  # the figure that predictors are ranked and compared by


def rendered(results: Sequence[Result], form: Format) -> str:
    """A text of all results.

    Args:
        results: of equal terms.
        form: markdown, csv or latex.
    """
    ways: dict[Format, Callable[[Sequence[Result]], str]] = {
        "markdown": markdown,
        "csv": comma_separated,
        "latex": latex,
    }
    return ways[form](ranked(with_best_baseline(results)))


def with_best_baseline(results: Sequence[Result]) -> list[Result]:
    """Also the analytical baseline at the cutoff and contact rule that does best on the other persons.

    Args:
        results: where filtered analytical baselines are several, one is made of them.
    """
    family = [one for one in results if one.name.startswith("analytical-")]
    if len(family) < 2:
        return list(results)
    return [*results, chosen_by_others(family, BEST_BASELINE, JUDGED)]


def ranked(results: Sequence[Result]) -> list[Result]:
    """By the force's error; those that see markers last."""

    def place(result: Result) -> tuple[bool, float]:
        found = average(result.scores, JUDGED)
        return result.sees_markers, found.mean if found else float("inf")

    return sorted(results, key=place)


def markdown(results: Sequence[Result], *, published: bool = True) -> str:
    """Headings, tables, tests and what differs from the paper.

    Args:
        results: in the order of the rows.
        published: whether the paper's rows stand below.
    """
    terms = results[0].terms
    first = average(results[0].scores, JUDGED)
    assert first is not None
    parts = ", ".join(terms.parts) if len(terms.parts) < 4 else f"{len(terms.parts)} folds"
    lines = [
        f"Release {terms.release} {terms.version}, split `{terms.split}`, tested: {parts}. "
        f"Persons: {first.persons}, trials: {first.trials}, frames: {first.frames} ({terms.frames}); "
        f"{terms.skeleton} skeleton. Means over persons of trials' means; 95 % intervals over persons "
        "(10 000 draws), – below five persons.",
        "",
        JUDGES,
        "",
        *_grid(results, PAPER),
        "",
        "Beside them:",
        "",
        *_grid(results, BESIDE, also=("Phase macro-F1", lambda one: _number(macro_f1(one.scores)))),
    ]
    banded = [one for one in results if average(one.scores, "coverage_95")]
    if banded:
        lines += ["", "Standard deviations, of those that give them:", "", *_grid(banded, BANDS)]
    lines += ["", f"{NAMES[JUDGED]} [{UNITS[JUDGED]}] by activity:", "", *_by_activity(results)]
    lines += ["", *_tests(results)]
    lines += [f"- {note}" for note in dict.fromkeys(note for one in results for note in one.notes)]
    lines += [
        f"- {one.name} sees the recorded markers, the others only angles."
        for one in results
        if one.sees_markers
    ]
    if published:
        lines += ["", *paper_rows()]
    return "\n".join(lines) + "\n"


def paper_rows() -> list[str]:
    """The paper's table, and what differs."""
    head = ["predictor", *(f"{NAMES[metric]} [{UNITS[metric]}]" for metric in PAPER)]
    rows = [[name, *values] for name, values in PAPER_ROWS]
    return [
        "Published figures, **not comparable**:",
        "",
        *_lines(head, rows),
        "",
        *(f"- {one}" for one in PAPER_DIFFERENCES),
    ]


def comma_separated(results: Sequence[Result]) -> str:
    """A line a predictor, figure and activity.

    Args:
        results: in the order of the lines.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    columns = (
        "mean",
        "low",
        "high",
        "over_frames",
        "over_trials",
        "over_activities",
        "persons",
        "trials",
        "frames",
    )
    rows.writerow(["predictor", "metric", "unit", "activity", *columns])
    for one in results:
        metrics = dict.fromkeys(score.metric for score in one.scores if not score.metric.startswith("phase:"))
        for metric in metrics:
            unit = UNITS.get(metric, "N·m/kg")
            for activity in (None, *_activities([one])):
                found = average(one.scores, metric, activity)
                if found:
                    rows.writerow(
                        [one.name, metric, unit, activity or "all", *(getattr(found, c) for c in columns)]
                    )
    return text.getvalue()


def latex(results: Sequence[Result]) -> str:
    """The paper's four figures as a table for booktabs; the paper's rows below a second line.

    Args:
        results: in the order of the rows.
    """
    head = " & ".join(f"{NAMES[metric]} [{_tex(UNITS[metric])}]" for metric in PAPER)
    own = [
        " & ".join([_tex(one.name), *(_tex(_cell(average(one.scores, m))) for m in PAPER)]) for one in results
    ]
    published = [" & ".join([_tex(name), *(_tex(value) for value in values)]) for name, values in PAPER_ROWS]
    body = [f"Method & {head} \\\\", "\\midrule", *(f"{row} \\\\" for row in own)]
    apart = [
        "\\midrule",
        "\\multicolumn{5}{l}{Published, not comparable} \\\\",
        *(f"{row} \\\\" for row in published),
    ]
    lines = ["\\begin{tabular}{lcccc}", "\\toprule", *body, *apart, "\\bottomrule", "\\end{tabular}"]
    return "\n".join(lines) + "\n"


def _grid(
    results: Sequence[Result],
    metrics: Sequence[str],
    also: tuple[str, Callable[[Result], str]] | None = None,
) -> list[str]:
    head = ["predictor", *(f"{NAMES.get(m, m)} [{UNITS[m]}]".replace(" [1]", "") for m in metrics)]
    rows = [[one.name, *(_cell(average(one.scores, m)) for m in metrics)] for one in results]
    if also:
        head.append(also[0])
        rows = [[*row, also[1](one)] for row, one in zip(rows, results, strict=True)]
    return _lines(head, rows)


def _by_activity(results: Sequence[Result]) -> list[str]:
    activities = _activities(results)
    sizes = {activity: average(results[0].scores, JUDGED, activity) for activity in activities}
    head = [
        "predictor",
        *(f"{a} (persons: {s.persons}, frames: {s.frames})" if s else a for a, s in sizes.items()),
    ]
    rows = [[one.name, *(_cell(average(one.scores, JUDGED, a)) for a in activities)] for one in results]
    return _lines(head, rows)


def _tests(results: Sequence[Result]) -> Iterator[str]:
    """The first of the rows against all others."""
    best, *others = results
    found = compared(
        best.name,
        {one.name: by_person(one.scores, JUDGED) for one in others},
        by_person(best.scores, JUDGED),
    )
    for one in found:
        yield (
            f"- {one.first} against {one.second}: the latter errs by {one.difference:+.3f} {UNITS[JUDGED]}; "
            f"signs of {one.persons} persons flipped, p = {one.p:.3f} ({one.p_holm:.3f} by Holm)."
        )


def _activities(results: Sequence[Result]) -> list[str]:
    return sorted({score.activity for one in results for score in one.scores})


def _lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]


def _cell(found: Average | None) -> str:
    if found is None:
        return "–"
    between = "–" if found.low is None else f"{found.low:.3f} … {found.high:.3f}"
    return f"{found.mean:.3f} ({between})"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _tex(text: str) -> str:
    for sign, code in (
        ("_", "\\_"),
        ("²", "$^2$"),
        ("·", "$\\cdot$"),
        ("–", "--"),
        ("…", "to"),
        (">", "$>$"),
        ("≈", "$\\approx$"),
    ):
        text = text.replace(sign, code)
    return text


def chosen_by_others(results: Sequence[Result], name: str, metric: str) -> Result:
    """Their scores as one result: nobody's own error has a say in what is chosen for them.

    Where nobody else has the activity, others' errors in all activities choose; where there is nobody else,
    the first of the predictors stands.

    Args:
        results: of like predictors on the same frames.
        name: of what is made of them.
        metric: whose smallest mean over persons is chosen.
    """
    activities = sorted({score.activity for score in results[0].scores})
    errors = {
        activity: [by_person(one.scores, metric, activity) for one in results]
        for activity in (None, *activities)
    }
    scores: list[Score] = []
    for person in sorted({score.person_id for score in results[0].scores}):
        for activity in activities:
            best = _best(errors[activity], person)
            best = _best(errors[None], person) if best is None else best
            scores += [
                score
                for score in results[best or 0].scores
                if score.person_id == person and score.activity == activity
            ]
    return replace(results[0], name=name, scores=tuple(scores), seconds=sum(one.seconds for one in results))


def _best(errors: Sequence[dict[str, float]], person: str) -> int | None:
    """Place of the predictor that is best on others; None where there are none."""
    means = [
        np.mean([value for other, value in own.items() if other != person] or [np.nan]) for own in errors
    ]
    return None if np.isnan(means).any() else int(np.argmin(means))
