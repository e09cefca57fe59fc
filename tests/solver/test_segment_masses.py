"""Faults edited into sound recordings do not move segment masses; a note says what they ask for."""

import numpy as np
import pytest

from benchmarks.faults.editor import edits, plates
from benchmarks.faults.editor.recording import write_folder
from benchmarks.faults.editor.sources import SOURCES
from solver.capture.subject.opened_subject import open_subject
from solver.dynamics.com_trajectory import MassEstimate
from solver.fitting.mass_stage import agreeing
from solver.fitting.pipeline import solve
from solver.skeleton.scaling import with_mass
from tests.conftest import NO_HELD_OUT

WALKS, RUN = "two treadmill walks A", "treadmill run C"
MOST_MOVED = 0.05
FROM_TABLES = 0.10


@pytest.fixture(scope="module")
def fitted(real_data, tmp_path_factory):
    """The fit of a source as it is (no edit) or edited; each is made once."""
    made = {}

    def fit(name, what="as it is", edit=None):
        if (name, what) not in made:
            recording = next(s for s in SOURCES if s.name == name).read(real_data)
            if edit is not None:
                recording, _ = edit(recording, np.random.default_rng(0))
            folder = tmp_path_factory.mktemp("recording")
            write_folder(folder, recording)
            made[name, what] = solve(open_subject(folder), NO_HELD_OUT)
        return made[name, what]

    return fit


def masses(fit):
    return np.array([body.mass for body in fit.skeleton.bodies])


def nominal(fit):
    return np.array([b.mass for b in with_mass(fit.groundwork.skeleton, fit.skeleton.mass).bodies])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "what", "edit"),
    [
        (WALKS, "turned", plates.turned(90.0)),
        (WALKS, "object", plates.standing_object(8.0, 0.2)),
        (RUN, "late", edits.late([0.03])),
    ],
)
def test_a_fault_moves_no_segment(fitted, name, what, edit):
    """Of the sound recording by more than 5 %, of the tables by more than 10 %."""
    sound, faulty = fitted(name), fitted(name, what, edit)
    heavy = masses(sound) > 0
    np.testing.assert_allclose(masses(faulty)[heavy], masses(sound)[heavy], rtol=MOST_MOVED)
    for fit in (sound, faulty):
        np.testing.assert_allclose(masses(fit)[heavy], nominal(fit)[heavy], rtol=FROM_TABLES)


@pytest.mark.slow
def test_a_trial_that_contradicts_the_others_does_not_weigh_the_body(fitted):
    faulty = fitted(WALKS, "object", plates.standing_object(8.0, 0.2))
    assert abs(faulty.mass_kg / fitted(WALKS).mass_kg - 1) < 0.01
    (note,) = [n for n in faulty.notes if "not used for the body's mass" in n]
    assert note.startswith("trial_b: its forces correspond to 80")
    assert not any("not used for the body's mass" in n for n in fitted(WALKS).notes)


@pytest.mark.slow
def test_a_note_names_segments_that_a_late_clock_asks_for(fitted):
    faulty = fitted(RUN, "late", edits.late([0.03]))
    (note,) = [n for n in faulty.notes if "better with other segment masses" in n]
    assert "tibia_r and tibia_l 1." in note
    assert not any("better with other segment masses" in n for n in fitted(WALKS).notes)


def test_of_two_that_differ_both_stay_and_of_three_the_odd_one_goes():
    def told(*masses):
        return [MassEstimate(m, 1.0, 0.2) for m in masses]

    assert agreeing(told(70.0, 78.0), 74.0, 0.06) == [True, True]  # nobody entered a mass: theirs is the mean
    assert agreeing(told(70.0, 78.0), 70.5, 0.06) == [True, False]
    assert agreeing(told(71.0, 78.0, 70.0), 73.0, 0.06) == [True, False, True]
    assert agreeing([*told(70.0), None], 80.0, 0.06) == [True, True]
