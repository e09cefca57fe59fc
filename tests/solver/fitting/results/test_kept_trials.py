"""Masks and proposals of a kept fit, read without the rest of it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import ResultsError
from solver.contact.detected_ranges import Proposal
from solver.fitting.results.kept_trials import kept_trials
from solver.fitting.results.store import load_fit, save_fit

FOUND = (Proposal((0, 2), "thigh", "notOverForcePlate", 0.9, {"missing_N": 512.0}),)


@pytest.fixture
def fit(small_fit):
    first, second = small_fit.trials
    return replace(small_fit, trials=(replace(first, proposals=FOUND), second))


def test_they_are_those_of_the_whole_fit(fit, tmp_path):
    save_fit(fit, tmp_path)
    whole = {trial.capture.name: trial for trial in load_fit(tmp_path, fit.subject.folder).trials}
    kept = kept_trials(tmp_path)
    assert {name: trial.proposals for name, trial in kept.items()} == {"walk": FOUND, "no/forces": ()}
    assert kept["walk"].feet == whole["walk"].contacts.foot_bodies
    assert np.array_equal(kept["walk"].mask.counts, whole["walk"].mask.counts)
    assert kept["walk"].mask.reasons == whole["walk"].mask.reasons
    assert kept["no/forces"].mask is None


def test_a_new_fit_is_read_anew(fit, small_fit, tmp_path):
    save_fit(fit, tmp_path)
    kept_trials(tmp_path)
    save_fit(small_fit, tmp_path)
    assert kept_trials(tmp_path)["walk"].proposals == ()


def test_no_fit_has_none_and_half_a_fit_is_an_error(fit, tmp_path):
    assert kept_trials(tmp_path) == {}
    save_fit(fit, tmp_path)
    next(tmp_path.glob("solve-*/trials/walk.npz")).unlink()
    with pytest.raises(ResultsError, match="Fit the subject again"):
        kept_trials(tmp_path)


def test_files_elsewhere_are_not_read(fit, tmp_path):
    results = tmp_path / "results"
    save_fit(fit, results)
    next(results.glob("solve-*/trials/walk.npz")).rename(tmp_path / "walk.npz")
    head = json.loads((results / "fit.json").read_text())
    head["files"] = ["../walk.npz"]
    (results / "fit.json").write_text(json.dumps(head))
    with pytest.raises(ResultsError, match=r"fit\.json.*names"):
        kept_trials(results)
