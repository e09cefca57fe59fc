"""Which stored diagnosis a report may show: the one of the same recordings, flags and settings as the fit."""

from collections.abc import Mapping
from pathlib import Path

from addb_viewer.app.diagnosis.state import decision_in_words, read_state
from addb_viewer.kept_diagnosis import kept
from addb_viewer.report.content import DiagnosisShown
from solver.fit import Fit
from solver.provenance import other_recordings, without_reviews

AGAIN = "`addb-viewer report SUBJECT --diagnose` makes it anew."


def diagnosis_shown(fit: Fit, results: Path) -> DiagnosisShown:
    """The kept diagnosis where it belongs to a fit, else why it is not shown.

    Args:
        fit: the one that the report is about.
        results: the results folder.

    Raises:
        ResultsError: what is kept cannot be read.
    """
    found = kept(results)
    if found is None:
        return DiagnosisShown()
    figures, made_of = found
    changed = _changed(fit, made_of, figures["trials"])
    if changed:
        return DiagnosisShown(
            absent=f"A diagnosis is kept, but since then these have changed: {', '.join(changed)}. {AGAIN}"
        )
    state = read_state(fit.subject, results, fit)
    return DiagnosisShown(figures, "", decision_in_words(state), state.gain)


def _changed(fit: Fit, made_of: Mapping[str, Mapping], trials: list[str]) -> list[str]:
    """What the diagnosis was made of and the fit was not."""
    then, now = made_of["provenance"], fit.provenance
    changed = other_recordings(then, now)
    if _reviews(then, trials) != _reviews(now, trials):
        changed.append("the flags")
    if made_of["settings"] != fit.settings:
        changed.append("the settings")
    return changed


def _reviews(provenance: Mapping[str, str], trials: list[str]) -> dict[str, str]:
    """What people had flagged in these trials, by its hash."""
    others = without_reviews(provenance)
    return {k: v for k, v in provenance.items() if k not in others and k.endswith(tuple(trials))}
