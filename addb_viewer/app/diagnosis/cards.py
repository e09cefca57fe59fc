"""The diagnosis on one screen, as the page's script draws it: verdict, one card a cause, before and after."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from addb_viewer.app.diagnosis.diagnosis_html import VERDICTS
from addb_viewer.text.cause_words import instead_of, when
from addb_viewer.text.diagnosis_vocabulary import (
    about,
    amounts,
    certainty,
    percent,
    rivals_of,
    short_title,
    sureness,
    tentative_of,
)
from addb_viewer.text.plain_words import in_plain_words
from addb_viewer.text.use_words import use
from addb_viewer.text.verdict_words import headline
from addb_viewer.trial_view.diagnosis_state import FIT_AGAIN, DiagnosisState, fit_in_words
from addb_viewer.trial_view.palette import GREY
from addb_viewer.trial_view.replay import Replay
from addb_viewer.trial_view.residual_charts import residual_charts, worst_frame
from addb_viewer.trial_view.trial_verdict import Reviews, flags_of, is_flagged
from annotations.events import FlagRange
from annotations.foot_names import foot_named
from annotations.reasons import reason_words
from solver.diagnosis.causes.catalogue import cannot_be_accepted
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, Rival
from solver.fitting.results.extension_log import ACCEPT, REJECT

MOST_POINTS = 400  # of a curve: more than pixels
LEFT_OUT = "Its frames are flagged: every fit leaves them out."
FILES_ONLY = "It lies in the markers alone: no fit can take it in. Correct the markers."


def key_of_cause(effect: Cause) -> str:
    """Names a cause between page and server."""
    return f"{effect.id} {effect.target}"


def screen_json(state: DiagnosisState, trials: Sequence[str], reviews: Reviews) -> dict[str, Any] | None:
    """Verdict and cards; None where nobody has asked yet.

    Args:
        state: of the subject.
        trials: that one can go to.
        reviews: of these trials.
    """
    figures = state.figures
    if figures is None:
        return None
    sign, word, color = VERDICTS.get(figures.verdict, ("?", figures.verdict, GREY))
    cards = [_card(state, figures, effect, trials, reviews) for effect in figures.effects]
    in_fit = fit_in_words(state)
    return {
        "verdict": {"sign": sign, "word": word, "color": color.css, "ink": color.ink.css},
        "text": in_plain_words(headline(figures)),
        "use": in_plain_words(use(figures)),
        "changed": list(state.changed),
        "cards": cards,
        "fit": in_fit,
        "fit_again": in_fit.endswith(FIT_AGAIN),
    }


def picture_json(figures: DiagnosisReport | None, replay: Replay | None) -> dict[str, Any] | None:
    """Residual force and moment of a trial over time, before and after; None where it was not diagnosed."""
    charts = () if figures is None or replay is None else residual_charts(figures, replay)
    if figures is None or replay is None or not charts:
        return None
    return {
        "trial": replay.name,
        "last": len(replay.times) - 1,
        "worst": worst_frame(figures, replay.name),
        "charts": [
            {
                "title": chart.title,
                "unit": chart.unit,
                "lines": [
                    {
                        "label": line.label,
                        "color": line.color.on_any_page,
                        "text": line.color.as_text,
                        "dashed": line.dashed,
                        "rms": _rms(line.values),
                        "values": _fewer(line.values),
                    }
                    for line in chart.lines
                ],
            }
            for chart in charts
        ],
    }


def _card(
    state: DiagnosisState, figures: DiagnosisReport, effect: Cause, trials: Sequence[str], reviews: Reviews
) -> dict[str, Any]:
    rivals = rivals_of(figures, effect)
    flags = flags_of(figures, effect, trials)
    standing = state.standings.get((effect.id, effect.target))
    flagged = bool(flags) and is_flagged(flags, reviews)
    why_not = FILES_ONLY if cannot_be_accepted(effect.id) else LEFT_OUT if flagged else ""
    is_accepted = standing is not None and standing.kind == ACCEPT
    timed = about(effect).at_certain_frames
    sizes, places = amounts(effect), _places(figures, effect) if timed else []
    return {
        "key": key_of_cause(effect),
        "title": short_title(effect),
        "size": in_plain_words(" · ".join([*sizes[:1], *places])),
        "sizes": in_plain_words("; ".join([*sizes, when(figures, effect)])),
        "sure": _sure(figures, effect),
        "certainty": certainty(effect.confidence, len(rivals)),
        "else": " · ".join(f"{instead_of(effect, r)}{_share(r)}" for r in rivals),
        "todo": in_plain_words(effect.remedy),
        "decided": "" if standing is None else f"{standing.kind}ed by {standing.by}",
        "when": "" if standing is None else f"{standing.when.astimezone():%Y-%m-%d %H:%M}",
        "standing": "" if standing is None else standing.kind,
        "can_accept": not (why_not or state.changed or is_accepted),
        "why_not": why_not,
        "can_reject": standing is None or standing.kind != REJECT,
        "flags": [_flag_words(trial, flag, len(set(trials))) for trial, flag in flags],
        "flagged": flagged,
        "goes": timed,
    }


def _places(figures: DiagnosisReport, effect: Cause) -> list[str]:
    """The first stretch of frames, and how many more there are."""
    ranges = sorted(effect.frames)
    more = f" and {len(ranges) - 1} more" if len(ranges) > 1 else ""
    return [f"{trial} {start}–{end - 1}{more}" for trial, start, end in ranges[:1]]


def _sure(figures: DiagnosisReport, effect: Cause) -> str:
    confidence = effect.confidence
    if any(effect is lead for lead in tentative_of(figures)):
        return f"only tentative, {percent(confidence)}"
    return f"{sureness(confidence)} sure"


def _share(rival: Rival) -> str:
    share = rival.confidence
    return "" if share is None else f" {percent(share)}"


def _flag_words(trial: str, flag: FlagRange, of: int) -> str:
    where = f"{trial} " if of > 1 else ""
    return f"{where}{flag.start}–{flag.end - 1}, {foot_named(flag.foot)}: {reason_words(flag.reason)}"


def _rms(values: Float[np.ndarray, " frames"]) -> float | None:
    known = values[np.isfinite(values)]
    return round(float(np.sqrt(np.mean(known**2))), 2) if len(known) else None


def _fewer(values: Float[np.ndarray, " frames"]) -> list[list[float] | None]:
    """Frame and value; of many frames the highest of each few, so that no peak is lost."""
    each = max(1, -(-len(values) // MOST_POINTS))
    points: list[list[float] | None] = []
    for start in range(0, len(values), each):
        few = values[start : start + each]
        known = np.isfinite(few)
        if not known.any():
            points.append(None)
        else:
            at = int(np.nanargmax(few))
            points.append([start + at, round(float(few[at]), 2)])
    return points
