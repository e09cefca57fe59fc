"""Which stored diagnosis belongs to a fit."""

from dataclasses import replace

import pytest

from addb_viewer.jobs.diagnosing import counts_of
from addb_viewer.jobs.kept_diagnosis import keep
from addb_viewer.report.reporting import diagnosis_shown


@pytest.fixture
def fit(make_fit):
    fit = make_fit("walk")
    for trial in fit.subject.trials:
        trial.markers.write_text("markers")
    provenance = {"numpy": "2", "mass_kg": "40.0", "sha256 0.trc": "a" * 64}
    provenance["sha256 of the review of walk"] = "b" * 64
    return replace(fit, provenance=provenance)


@pytest.fixture
def shown(fit, diagnosis, tmp_path):
    """What is shown of a diagnosis whose inputs differ from the fit's so."""

    def of(provenance=None, settings=None, **more):
        made_from = {
            "provenance": {**fit.provenance, **(provenance or {})},
            "settings": {**fit.settings, **(settings or {})},
            **more,
        }
        keep(diagnosis, made_from, tmp_path)
        return diagnosis_shown(fit, tmp_path)

    return of


def test_nobody_has_asked(fit, tmp_path):
    assert diagnosis_shown(fit, tmp_path).absent.startswith("Nobody has asked")


def test_the_diagnosis_of_the_same_inputs_is_shown_whatever_the_versions(shown, diagnosis):
    assert shown({"numpy": "1"}).figures == diagnosis


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"provenance": {"sha256 0.trc": "c" * 64}}, "0.trc"),
        ({"provenance": {"mass_kg": "41.0"}}, "mass_kg"),
        ({"provenance": {"sha256 of the review of walk": "c" * 64}}, "the flags"),
        ({"settings": {"contact": {}}}, "the settings"),
    ],
)
def test_a_diagnosis_of_other_inputs_is_not_shown_and_the_difference_is_named(shown, changed, named):
    found = shown(**changed)
    assert found.figures is None
    assert f"these have changed: {named}. " in found.absent


def test_flags_that_change_no_force_that_counts_do_not_matter(shown, diagnosis, fit):
    other_flags = {"sha256 of the review of walk": "c" * 64}
    same = counts_of({"walk": fit.trials[0].mask})
    assert shown(other_flags, counts=same).figures == diagnosis
    turned = replace(fit.trials[0].mask, counts=~fit.trials[0].mask.counts)
    assert shown(other_flags, counts=counts_of({"walk": turned})).figures is None


def test_flags_of_trials_that_it_is_not_about_do_not_matter(shown, diagnosis):
    assert shown({"sha256 of the review of run": "d" * 64}).figures == diagnosis
