"""The kept diagnosis as the panel gets it: does it still hold, who decided what, does the fit use it."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.jobs.accepted_extension import keep_gain
from addb_viewer.jobs.kept_diagnosis import keep
from addb_viewer.trial_view.diagnosis_state import decision_in_words, read_state
from solver.common.errors import ResultsError
from solver.diagnosis.diagnosis_report import AcceptedGain
from solver.dynamics.trajectory.extension import Cause, Extension
from solver.fitting.provenance import provenance_of
from solver.fitting.results import extension_log

LATE = Cause("clock_offset", "all", {"offset_s": (0.012, 0.001)})


@pytest.fixture
def diagnosed(small_fit, effect, figures):
    """A subject with files and a kept diagnosis, its results folder, and the fit."""
    subject = small_fit.subject
    for trial in subject.trials:
        trial.markers.parent.mkdir(parents=True)
        trial.markers.write_text(f"markers of {trial.name}")
    results = subject.folder / "results"
    found = figures(effect("clock_offset", "all", offset_s=0.012))
    named = replace(found, trials=tuple(t.name for t in subject.trials))
    keep(named, {"provenance": provenance_of(subject, subject.trials), "settings": {}}, results)
    return subject, results, small_fit


def extension():
    return Extension((LATE,), np.ones(1), np.zeros(1))


def fitted_with(fit, extension):
    return replace(fit, provenance=provenance_of(fit.subject, fit.subject.trials, extension=extension))


def test_nothing_kept_is_an_empty_state(small_fit, tmp_path):
    state = read_state(small_fit.subject, tmp_path / "none", small_fit)
    assert state.figures is None
    assert decision_in_words(state) == ""
    assert not state.acceptable
    assert not state.rejectable


def test_a_diagnosis_can_be_accepted_until_a_recording_changes(diagnosed):
    subject, results, fit = diagnosed
    state = read_state(subject, results, fit)
    assert state.acceptable
    assert state.rejectable
    subject.trials[0].markers.write_text("others")
    state = read_state(subject, results, fit)
    assert not state.acceptable
    assert len(state.changed) == 1
    assert subject.trials[0].markers.name in state.changed[0]


def test_a_fault_in_the_markers_alone_cannot_be_accepted(diagnosed, effect, figures):
    subject, results, fit = diagnosed
    slipped = replace(figures(effect("marker_slip", "RTOE", shift_m=0.02)), trials=())
    keep(slipped, {"provenance": {}, "settings": {}}, results)
    assert not read_state(subject, results, fit).acceptable
    swapped = replace(figures(effect("marker_swap", "RTOE+RMT5", ((10, 20),))), trials=())
    keep(swapped, {"provenance": {}, "settings": {}}, results)
    assert read_state(subject, results, fit).acceptable  # a fit exchanges them back


def test_an_acceptance_says_by_whom_and_whether_the_fit_uses_it(diagnosed):
    subject, results, fit = diagnosed
    extension_log.accept(results, extension(), by="Zoë", made_from={}, left_out=("marker_slip (RTOE)",))
    said = decision_in_words(read_state(subject, results, fit))
    assert said.startswith("Accepted by Zoë on 20")
    assert "forces shifted in time" in said
    assert "marker_slip (RTOE)" in said
    assert "does not use it yet" in said
    used = fitted_with(fit, extension())
    assert "The fit on the screen uses it." in decision_in_words(read_state(subject, results, used))


def test_the_last_decision_holds(diagnosed):
    subject, results, fit = diagnosed
    extension_log.accept(results, extension(), by="Zoë", made_from={})
    extension_log.reject(results, (LATE,), by="Ada", made_from={})
    said = decision_in_words(read_state(subject, results, fit))
    assert said.startswith("Rejected by Ada")
    assert "The fit on the screen uses the recorded forces alone." in said


def test_a_fit_that_still_holds_what_was_rejected_or_accepted_before_is_told(diagnosed):
    subject, results, fit = diagnosed
    extension_log.accept(results, extension(), by="Zoë", made_from={})
    old = fitted_with(fit, extension())
    extension_log.reject(results, (LATE,), by="Ada", made_from={})
    for again in (None, 2.0):
        if again is not None:
            other = replace(extension(), x=np.full(1, again))
            extension_log.accept(results, other, by="Zoë", made_from={})
            assert "uses it" in decision_in_words(read_state(subject, results, fitted_with(fit, other)))
        said = decision_in_words(read_state(subject, results, old))
        assert "still uses what was accepted before: fit again." in said
    assert "The next fit uses it." in decision_in_words(read_state(subject, results, None))


def test_what_accepting_gained_is_kept_with_the_decision(diagnosed):
    subject, results, fit = diagnosed
    decision = extension_log.accept(results, extension(), by="Zoë", made_from={})
    assert read_state(subject, results, fit).gain is None
    path = keep_gain(AcceptedGain((), ()), decision, results)
    assert read_state(subject, results, fit).gain == AcceptedGain((), ())
    path.write_text("{")
    with pytest.raises(ResultsError, match=r"extension-1\.json.*addb-viewer accept"):
        read_state(subject, results, fit)
    extension_log.reject(results, (LATE,), by="Ada", made_from={})
    assert read_state(subject, results, fit).gain is None


def test_a_decision_about_another_diagnosis_says_so(diagnosed, effect, figures):
    subject, results, fit = diagnosed
    extension_log.reject(results, (LATE,), by="Ada", made_from={})
    other = replace(figures(effect("plate_gain", "plate_1", gain_error=0.05)), trials=())
    keep(other, {"provenance": {}, "settings": {}}, results)
    assert "about another diagnosis" in decision_in_words(read_state(subject, results, fit))


def test_a_torn_file_is_an_error_that_names_it(diagnosed):
    subject, results, fit = diagnosed
    (results / "diagnosis.json").write_text("{")
    with pytest.raises(ResultsError, match=r"diagnosis\.json"):
        read_state(subject, results, fit)
