"""Causes that a diagnosis has named, found again, and as extra wrenches of the trajectory fit."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import FitError
from solver.diagnosis import accepted_causes
from solver.diagnosis.accepted_causes import causes_of, extension_of
from solver.diagnosis.causes.body_masses import CarriedMass, SubjectMass
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.effect import Range
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.marker_causes import NOTHING_SEEN
from solver.diagnosis.search.contenders import Contender
from solver.diagnosis.search.selection import CorrectedCause, Selection
from solver.fitting.settings import Settings
from tests.solver.diagnosis.late_walk import LATE_S, rms

FLAGGED = slice(20, 40)  # frames
ONE, OTHER = ("plate_gain", "plate_1"), ("plate_gain", "plate_2")


@pytest.fixture
def found(monkeypatch, short_scene, balance_of_scenes):
    """Runs `extension_for` on causes, of which some are found again and others are undone on reading."""
    counts = short_scene.counts.copy()
    counts[FLAGGED] = False
    balance = balance_of_scenes(replace(short_scene, counts=counts))

    def contender(target):
        solved = balance.solve([balance.term(PlateGain(target), ())])
        return Contender(solved.terms[0], solved, 20.0)

    def run(again, undone, wanted, frames=None):
        null = balance.solve([])
        solved = balance.solve([contender(t).term for t in again])
        selection = Selection(
            null, solved, (), corrected=tuple(CorrectedCause(contender(t), t) for t in undone)
        )
        monkeypatch.setattr(
            accepted_causes, "repaired_balance", lambda *_, **__: (balance, NOTHING_SEEN, None)
        )
        monkeypatch.setattr(accepted_causes, "select", lambda *_: selection)
        subject = type("Subject", (), {"folder": "lab/S4"})
        return accepted_causes.extension_for(subject, Settings(), dict.fromkeys(wanted, ()) | (frames or {}))

    return run


def test_what_reading_undoes_is_no_part_of_the_extension_and_not_lost(found):
    answer = found(["plate_1"], ["plate_2"], {ONE, OTHER})
    assert [(c.id, c.target) for c in answer.extension.causes] == [ONE]
    assert answer.undone == (OTHER,)
    (cause,) = answer.causes_at(answer.extension.x + 0.01)
    assert cause.parameters["gain_error"][0] != answer.extension.causes[0].parameters["gain_error"][0]


def test_of_somebody_weighed_it_is_about_a_body_of_the_scales_mass(short_scene, balance_of_scenes):
    balance = balance_of_scenes(replace(short_scene, scale_factor=1.05))
    solved = balance.solve([balance.term(SubjectMass("all"), ())])
    (wrench,) = extension_of(balance.scenes, solved).trials["walk"].parts
    np.testing.assert_allclose(wrench.fixed_ground[:, 1], 0.05 * short_scene.required_ground[:, 1])
    np.testing.assert_allclose(wrench.fixed_ground + wrench.columns_ground @ [0.05], 0.0, atol=1e-6)


def test_where_reading_undoes_all_nothing_is_to_be_accepted(found):
    with pytest.raises(FitError, match=r"lab/S4: nothing to accept: every fit corrects"):
        found([], ["plate_2"], {OTHER})


def test_a_cause_that_is_not_found_again_is_named(found):
    with pytest.raises(FitError, match=r"not found again: plate_gain \(plate_2\)"):
        found(["plate_1"], [], {ONE, OTHER})


def test_a_cause_whose_frames_are_flagged_since_is_settled_and_the_others_are_accepted(found, short_scene):
    there = Range(short_scene.name, FLAGGED.start + 2, FLAGGED.stop + 2)
    answer = found(["plate_1"], [], {ONE}, {OTHER: (there,)})
    assert [(c.id, c.target) for c in answer.extension.causes] == [ONE]
    assert answer.flagged == (OTHER,)
    with pytest.raises(FitError, match=r"leaves out the frames of plate_gain \(plate_2\)"):
        found([], [], (), {OTHER: (there,)})
    elsewhere = Range(short_scene.name, FLAGGED.stop, FLAGGED.stop + 20)
    with pytest.raises(FitError, match="not found again"):
        found(["plate_1"], [], {ONE}, {OTHER: (elsewhere,)})


FEW = 0.02  # of the trial's frames


def test_a_clocks_correction_gives_each_foot_what_it_had_on_time(late, on_time, late_extension):
    """Against the recording on time, foot by foot, where the same foot stands in both."""
    (extra,) = late_extension.trials.values()
    trial, right = late.fit.trials[0].contacts, on_time.fit.trials[0].contacts
    for foot, name in enumerate(trial.foot_bodies):
        (part,) = [p for p in extra.parts if p.body == name]
        inside = right.in_contact[:, foot] & trial.in_contact[:, foot] & extra.known
        error = (right.wrench_ground - trial.wrench_ground)[inside, foot, :3]
        left = error - part.at(late_extension.x)[inside, :3]
        assert rms(left) < 0.15 * rms(error)


def test_columns_of_eta_are_its_derivatives(late, late_clock, late_extension):
    """Against the signature 4 and 2 ms away: what is left is of second order."""
    (extra,) = late_extension.trials.values()
    (eta,), candidate = late_clock.eta(0)[0], ClockOffset("all")
    left = []
    for step in (0.004, 0.002):
        expected = candidate.signature(late.scene, (eta + step,)).fixed
        ahead = extra.fixed_ground + extra.columns_ground @ (late_extension.x + step)
        left.append(rms((expected - ahead)[extra.known]))
    at = extra.fixed_ground + extra.columns_ground @ late_extension.x
    same = candidate.signature(late.scene, (eta,)).fixed
    np.testing.assert_allclose(at[extra.known], same[extra.known], atol=1e-6)
    assert left[1] < 0.3 * left[0]


def test_causes_are_told_with_the_parameters_of_another_fit(late, late_clock, late_extension):
    (cause,) = causes_of(late.balance.scenes, late_clock, late_extension.x + 0.001)
    value, std = late_extension.causes[0].parameters["offset_s"]
    assert cause.parameters["offset_s"] == pytest.approx((value + 0.001, std))


def test_frames_beyond_the_clock_are_not_known(late, late_extension):
    (extra,) = late_extension.trials.values()
    assert late_extension.x[0] == pytest.approx(LATE_S, abs=0.003)
    assert 0 < (~extra.known).sum() < FEW * len(extra.known)
    assert not extra.known[-1]


def test_linear_columns_and_their_places(late):
    """A plate's gain acts on the foot that stands on it, a load on its segment."""
    for candidate in (PlateGain("plate_2"), CarriedMass("torso")):
        solved = late.solved(candidate)
        extension = extension_of(late.balance.scenes, solved)
        (extra,) = extension.trials.values()
        signature = candidate.signature(late.scene, ())
        np.testing.assert_allclose(extra.columns_ground, signature.columns, atol=1e-9)
        np.testing.assert_array_equal(extension.prior_std, signature.prior_std)
        assert extra.known.all()
        acts = {p.body for p in extra.parts if np.abs(p.columns_ground).max() > 0}
        if candidate.id == "carried_mass":
            assert acts == {"torso"}
        else:
            contacts = late.fit.trials[0].contacts
            owners = np.unique(contacts.plate[late.scene.plates[1].loaded, 1])
            assert acts - {None} <= {contacts.foot_bodies[i] for i in owners if i >= 0} | set(
                contacts.foot_bodies
            )
            part = next(p for p in extra.parts if p.body == contacts.foot_bodies[owners[0]])
            loaded = late.scene.plates[1].loaded
            np.testing.assert_allclose(part.columns_ground[loaded], signature.columns[loaded])
