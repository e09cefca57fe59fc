"""What the diagnosis looks at of a fit, and the body's size against the person's own model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from solver.capture.capture import ForcePlate, Subject
from solver.capture.plates.conditioning import condition
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.wrenches import FrameMask
from solver.diagnosis.causes.capture_scale import OWN_MODEL_STD, PRIOR_STD, CaptureScale
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.scenes import (
    Posterior,
    flagged_by_people,
    observed_markers,
    scene_of,
    scenes_of,
    size_against_own_model,
)
from solver.fitting.fit_result import Fit, KinematicsOnly, TrialFit
from solver.fitting.settings import Settings
from solver.kinematics.marker_errors import MarkerErrors
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import measure, plates_under
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.scaling import scaled, with_mass
from tests.flagged import flagged
from tests.solver.diagnosis.causes.conftest import NOISELESS

SETTINGS = Settings()
REVIEWED = (60, 70, None, "manualReview")
BLIND = slice(20, 25)


@pytest.fixture(scope="module")
def trial(short_walk, short_scene) -> TrialFit:
    """The short walk as a fit that took the truth's motion from the markers; detection masked all of it."""
    plates = plates_under(short_walk.contacts, (0.0, short_walk.scenario.duration))
    capture = measure(short_walk, plates, MARKERS, NOISELESS, np.random.default_rng(0))
    names = capture.markers.names
    count = short_scene.frames
    model = np.stack([short_scene.markers.model_ground[:, short_scene.markers.names.index(n)] for n in names])
    return TrialFit(
        capture=capture,
        motion=short_scene.motion,
        marker_errors=MarkerErrors(names, np.zeros((count, len(names)))),
        model_markers_ground=model.transpose(1, 0, 2),
        contacts=short_scene.contacts,
        mask=FrameMask(np.zeros((count, 2), dtype=bool), source="proposals"),
    )


@pytest.fixture(scope="module")
def looked_at(trial, short_scene) -> tuple[Scene, Posterior]:
    """Of two trials, the first without forces, frames flagged; a scale, as the fit, has more than entered."""
    subject, heavier = Subject(Path("someone"), (), scale_factor=1.05), with_mass(short_scene.skeleton, 71.4)
    fit = Fit(subject, heavier, (replace(trial, contacts=None), trial), 68.0, 1.72)
    (found,) = scenes_of(fit, SETTINGS, {trial.capture.name: flagged(REVIEWED)})
    return found


@pytest.fixture(scope="module")
def seen(looked_at) -> Scene:
    return looked_at[0]


@pytest.fixture
def same_markers(looked_at, monkeypatch):
    """For tests that change plates alone: what the markers say of the motion is not worked out again."""
    monkeypatch.setattr("solver.diagnosis.scenes.trial_posterior", lambda *_: looked_at[1])


@pytest.fixture(scope="module")
def altered(trial, short_scene) -> Scene:
    """The same markers; plates read half, one has no corners; the motion bent to forces; frames blind."""
    plates = [
        replace(p, force_ground=0.5 * p.force_ground, moment_ground=0.5 * p.moment_ground)
        for p in trial.capture.plates
    ]
    plates[0] = replace(plates[0], corners_ground=None)
    distance = trial.marker_errors.distance.copy()
    distance[BLIND] = np.nan
    other = replace(
        trial,
        capture=replace(trial.capture, plates=tuple(plates)),
        marker_errors=replace(trial.marker_errors, distance=distance),
        motion=replace(trial.motion, q=trial.motion.q + 0.3),
        kinematics_only=KinematicsOnly(trial.motion, trial.marker_errors),
    )
    return scene_of(other, short_scene.skeleton, SETTINGS)[0]


def test_the_demand_is_that_of_the_true_motion(seen, demands, short_scene):
    """Against Pinocchio's algorithms on the motion that made the markers, whose bandwidth is wider."""
    inside = slice(10, -10)
    true = demands(short_scene.skeleton)[inside]
    error = seen.required_ground[inside] - true
    changing = true - true.mean(axis=0)
    assert (error**2).mean(axis=0)[:3].sum() < 0.05 * (changing**2).mean(axis=0)[:3].sum()
    assert seen.required_ground[inside, 1].mean() == pytest.approx(true[:, 1].mean(), rel=0.005)


def test_motion_and_demand_do_not_come_from_the_forces(altered, seen):
    """Neither from the plates nor from a motion that was bent to them."""
    np.testing.assert_allclose(altered.motion.q, seen.motion.q, atol=1e-9)
    np.testing.assert_allclose(altered.required_ground, seen.required_ground, atol=1e-6)
    ratio = np.abs(altered.measured_ground).sum() / np.abs(seen.measured_ground).sum()
    assert ratio == pytest.approx(0.5, abs=0.01)


def test_a_trial_of_a_few_frames_is_no_scene(trial, short_scene):
    short = replace(trial, motion=replace(trial.motion, q=trial.motion.q[:7]))
    fit = Fit(Subject(Path("someone"), ()), short_scene.skeleton, (short,), 68.0, 1.72)
    assert scenes_of(fit, SETTINGS, {}) == []


def test_plates_are_named_in_order_and_keep_their_wrench(seen, trial, short_scene):
    assert [p.target for p in seen.plates] == [f"plate_{k + 1}" for k in range(len(seen.plates))]
    for plate, same, recorded in zip(seen.plates, short_scene.plates, trial.capture.plates, strict=True):
        np.testing.assert_allclose(plate.wrench_ground, same.wrench_ground, atol=1e-9)
        np.testing.assert_allclose(plate.centre_ground, recorded.corners_ground.mean(axis=0))
        loaded = plate.wrench_ground[:, 1] >= SETTINGS.conditioning.threshold_N
        np.testing.assert_array_equal(plate.loaded, loaded)


def test_without_corners_the_centre_is_the_middle_of_where_it_was_pressed(altered, trial):
    first = trial.capture.plates[0]
    pressed = first.cop_ground[first.force_ground[:, 1] > 50.0]  # [N]
    middle = (np.nanmin(pressed, axis=0) + np.nanmax(pressed, axis=0)) / 2
    np.testing.assert_allclose(altered.plates[0].centre_ground, middle, atol=0.02)


def test_only_people_and_missing_markers_take_frames_out(altered, seen, trial):
    """The mask made of proposals, which took all frames out, does not."""
    start, end, *_ = REVIEWED
    by_people, blind = trial.contacts.observed.copy(), trial.contacts.observed.copy()
    by_people[start:end] = False
    blind[BLIND] = False
    np.testing.assert_array_equal(seen.counts, by_people)
    np.testing.assert_array_equal(altered.counts, blind)


def test_observed_markers_are_those_that_were_fitted(trial, short_scene):
    left_out = trial.marker_errors.names[0]
    errors = MarkerErrors(trial.marker_errors.names[1:], trial.marker_errors.distance[:, 1:])
    observed = observed_markers(replace(trial, marker_errors=errors), short_scene.skeleton)
    names = short_scene.skeleton.marker_names
    assert np.isnan(observed[:, names.index(left_out)]).all()
    recorded = trial.capture.markers
    for name in errors.names:
        np.testing.assert_array_equal(
            observed[:, names.index(name)], recorded.positions_ground[:, recorded.names.index(name)]
        )


def test_on_frames_without_a_pose_no_marker_says_anything(trial, short_scene):
    q = trial.motion.q.copy()
    q[:20] = np.nan
    observed = observed_markers(replace(trial, motion=replace(trial.motion, q=q)), short_scene.skeleton)
    seen = np.isfinite(observed).any(axis=(1, 2))
    np.testing.assert_array_equal(seen, np.arange(len(q)) >= 20)


def test_flags_in_the_store_come_before_those_in_a_file(trial):
    imported = np.zeros(trial.motion.frames, dtype=bool)
    imported[3:9] = True
    reviewed = replace(trial, capture=replace(trial.capture, imported_missing_force=imported))
    assert flagged_by_people(trial, {}) == ()
    assert [(start, end) for start, end, *_ in flagged_by_people(reviewed, {})] == [(3, 9)]
    name = trial.capture.name
    both = flagged_by_people(reviewed, {name: flagged(REVIEWED)})
    assert both == ((3, 9, None, "manualReview"), REVIEWED)
    taken_back = ForceReview(by_people=(ForceLabel(0, 9, None, None),))
    assert flagged_by_people(reviewed, {name: taken_back}) == ()
    assert len(flagged_by_people(reviewed, {"another": flagged(REVIEWED)})) == 1


@pytest.mark.usefixtures("same_markers")
@pytest.mark.parametrize("lost", [0, 1, 5, 9, 10, 11])
def test_forces_that_end_before_the_markers_are_there_on_all_frames_that_count(trial, short_scene, lost):
    """As the fit has them, however many of the last samples are lost."""
    plates = tuple(_ending_early(p, 40 * 10 + lost) for p in trial.capture.plates)
    contacts = replace(trial.contacts, observed=_seen_by_the_fit(plates, trial.motion.times))
    other = replace(trial, capture=replace(trial.capture, plates=plates), contacts=contacts)
    scene = scene_of(other, short_scene.skeleton, SETTINGS)[0]
    assert 30 < (~scene.counts).sum() < 50
    for seen_as, plate in zip(scene.plates, plates, strict=True):
        fitted = condition(plate, trial.motion.times)
        wrench = np.concatenate([fitted.force_ground, fitted.moment_ground], axis=1)
        np.testing.assert_allclose(seen_as.wrench_ground[scene.counts], wrench[scene.counts], atol=1e-6)


@pytest.mark.usefixtures("same_markers")
def test_where_a_plate_recorded_nothing_for_a_while_it_has_no_force_and_no_clock_reads_one(
    trial, short_scene
):
    first = trial.capture.plates[0]
    force = first.force_ground.copy()
    force[300:500] = np.nan
    plates = (replace(first, force_ground=force), *trial.capture.plates[1:])
    other = replace(trial, capture=replace(trial.capture, plates=plates))
    seen_as = scene_of(other, short_scene.skeleton, SETTINGS)[0].plates[0]
    observed = condition(plates[0], trial.motion.times).observed
    assert 15 < (~observed).sum() < 25
    assert not seen_as.wrench_ground[~observed].any()
    np.testing.assert_array_equal(seen_as.covers(seen_as.times), observed)
    later = seen_as.times + 0.05
    np.testing.assert_array_equal(
        np.isfinite(seen_as.at_times(seen_as.loads.wrench_ground, later)).all(axis=1), seen_as.covers(later)
    )


def _ending_early(plate: ForcePlate, lost: int) -> ForcePlate:
    return replace(
        plate,
        force_ground=plate.force_ground[:-lost],
        moment_ground=plate.moment_ground[:-lost],
        cop_ground=plate.cop_ground[:-lost],
    )


def _seen_by_the_fit(plates: tuple[ForcePlate, ...], times: np.ndarray) -> np.ndarray:
    return np.all([condition(p, times).observed for p in plates], axis=0)


MASS_KG = 71.0


@pytest.fixture(scope="module")
def model():
    return default_skeleton(mass_kg=MASS_KG, height_m=1.75)


@pytest.fixture
def fit_of(model, tmp_path):
    """A fit whose body is the model's, each body larger by a factor of its own."""
    path = tmp_path / "own.osim"
    write_skeleton(model, path)

    def made(factors: np.ndarray, mass_kg: float | None = MASS_KG, with_model: bool = True) -> Fit:
        subject = Subject(tmp_path, (), model=path if with_model else None, mass_kg=mass_kg)
        return Fit(subject, scaled(model, np.repeat(factors[:, None], 3, axis=1)), (), MASS_KG, 1.75)

    return made


@pytest.fixture(scope="module")
def bodies(model):
    return len(model.bodies)


@pytest.mark.parametrize("factor", [0.985, 1.0, 1.02])
def test_one_factor_of_all_segments_is_the_size(fit_of, bodies, factor):
    assert size_against_own_model(fit_of(np.full(bodies, factor))) == pytest.approx(np.log(factor), abs=1e-6)


def test_a_model_of_other_proportions_is_nobodys(fit_of, bodies):
    factors = 1 + 0.03 * np.random.default_rng(1).choice([-1, 1], bodies)
    assert size_against_own_model(fit_of(factors)) is None


@pytest.mark.parametrize("mass_kg", [0.98 * MASS_KG, None])
def test_a_model_of_another_mass_is_nobodys(fit_of, bodies, mass_kg):
    assert size_against_own_model(fit_of(np.full(bodies, 1.02), mass_kg=mass_kg)) is None


def test_no_model_says_nothing(fit_of, bodies):
    assert size_against_own_model(fit_of(np.full(bodies, 1.02), with_model=False)) is None


def test_what_segments_scatter_by_is_no_obstacle(fit_of, bodies):
    factors = 1.01 * (1 + 0.002 * np.random.default_rng(2).standard_normal(bodies))
    found = size_against_own_model(fit_of(factors))
    assert found == pytest.approx(np.log(1.01), abs=0.003)


def test_a_size_is_evidence_as_two_gaussians_have_it(model):
    """For the scale against none: densities of the measured size under both."""
    for size in (-0.012, 0.0, 0.008):
        with_scale = norm.logpdf(size, 0, np.hypot(OWN_MODEL_STD, PRIOR_STD))
        expected = with_scale - norm.logpdf(size, 0, OWN_MODEL_STD)
        assert CaptureScale("all", size).seen_elsewhere == pytest.approx(expected)
    assert replace(CaptureScale("all", 0.01), log_size=None).seen_elsewhere == 0
