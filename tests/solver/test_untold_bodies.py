"""Bodies that no marker tells: forces must not bend them in place of what is wrong elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.fitting.fit_result import Fit
from solver.fitting.pipeline import solve
from solver.fitting.settings import settings_for
from solver.kinematics.unseen_bodies import undetermined_dofs
from solver.simulate.faults.recorded import cut

NEUTRAL_DEG = 15.0


def furthest_deg(fit: Fit) -> dict[str, float]:
    """Of each degree of freedom that moves no marker, how far it goes from the neutral pose."""
    skeleton = fit.skeleton
    away = np.degrees(np.abs(fit.trials[0].motion.q - skeleton.default_q)).max(axis=0)
    untold = undetermined_dofs(skeleton, fit.groundwork.match.observed(fit.trials[0].capture.markers))
    return {dof: away[i] for i, dof in enumerate(skeleton.dofs) if untold[i]}


def fitted(folder, trial, frames, *, default_body=False, keep=lambda label: True):
    subject = replace(open_subject(folder), static=None)
    settings = settings_for(folder)
    settings = replace(settings, trajectory=replace(settings.trajectory, held_out=False))
    if default_body:
        subject = replace(subject, model=None)
    capture = cut(read_trial(next(t for t in subject.trials if t.name == trial), settings.reading), *frames)
    markers = capture.markers
    kept = [i for i, label in enumerate(markers.names) if keep(label)]
    markers = replace(
        markers,
        names=tuple(markers.names[i] for i in kept),
        positions_ground=markers.positions_ground[:, kept],
    )
    return solve(subject, settings, trials=[trial], captures={trial: replace(capture, markers=markers)})


@pytest.mark.slow
@pytest.mark.parametrize("default_body", [False, True])
def test_a_trunk_that_a_laboratory_never_marked_stays_near_neutral_and_is_named(real_data, default_body):
    folder = real_data / "overground_camargo2021_AB06"
    fit = fitted(folder, "levelground_ccw_fast_01_01", (110, 330), default_body=default_body)
    away = furthest_deg(fit)
    assert {"lumbar_extension", "lumbar_bending", "lumbar_rotation"} <= away.keys()
    assert max(away.values()) < NEUTRAL_DEG, away
    assert any("neutral" in note and "torso" in note for note in fit.notes)


def test_a_landing_bends_no_trunk_whose_markers_are_gone(real_data):
    """The hardest case: the trunk did bend, by 36°, and the forces ask for it."""
    upper = ("C7", "Shoulder", "Sternum", "humerus", "elbow", "forearm", "wrist")
    fit = fitted(
        real_data / "opencap_subject4",
        "DJ1",
        (120, 269),
        keep=lambda label: not any(word in label for word in upper),
    )
    away = furthest_deg(fit)
    assert "lumbar_extension" in away
    assert max(away.values()) < NEUTRAL_DEG, away
