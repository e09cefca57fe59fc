"""Markers first: what is found in them and repaired, and what distances between markers say."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.capture.capture import Capture, Markers, Subject
from solver.diagnosis import marker_causes
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.causes.segment_displaced import SegmentDisplaced
from solver.diagnosis.direct_checks.statement import About, Statement
from solver.diagnosis.marker_causes import ROUNDS, SeenInMarkers, as_distances_tell, with_markers_repaired
from solver.diagnosis.scenes import observed_markers
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.settings import Settings
from solver.kinematics.marker_errors import MarkerErrors
from solver.simulate.person import Person
from solver.simulate.simulated_trial import Scenario
from tests.solver.diagnosis.tracked_markers import RATE, record_markers, slip, track

SLIPPED, SLIP_M, SLIP_FRAME = "LTB1", np.array([0.0, -0.02, 0.006]), 110
SWAPPED, SWAP = ("LASI", "RASI"), slice(150, 251)
LOOSE = "WAND"  # recorded, and no marker of the model


class Laboratory:
    """Fits recordings by inverse kinematics, and shows them without a posterior: no force is looked at."""

    def __init__(self, base: Scene, observed: Mapping[str, np.ndarray], obeys: bool = True) -> None:
        self.base, self.skeleton, self.obeys = base, base.skeleton, obeys
        self.asked: list[dict[str, Capture]] = []
        self.scenes = {}
        self.captures = {name: Capture(name, self._markers(o)) for name, o in observed.items()}

    def _markers(self, observed: np.ndarray) -> Markers:
        names = (LOOSE, *self.skeleton.marker_names)
        loose = np.full((len(observed), 1, 3), 0.7)
        return Markers(names, np.concatenate([loose, observed], axis=1), RATE)

    def fitted(self, repaired: Mapping[str, Capture]) -> Fit:
        """As `solve` does with `captures`; a fit that doesn't obey reads the files again."""
        self.asked.append(dict(repaired))
        used = repaired if self.obeys else {}
        trials = tuple(self._trial(used.get(name, c)) for name, c in self.captures.items())
        return Fit(Subject(Path("someone"), ()), self.skeleton, trials, 75.0, 1.80)

    def _trial(self, capture: Capture) -> TrialFit:
        known = capture.name in self.scenes and self.scenes[capture.name][0] is capture
        if not known:
            scene = track(self.base, capture.markers.positions_ground[:, 1:])
            self.scenes[capture.name] = capture, scene
        scene = self.scenes[capture.name][1]
        distance = np.linalg.norm(scene.markers.observed_ground - scene.markers.model_ground, axis=2)
        errors = MarkerErrors(self.skeleton.marker_names, distance)
        return TrialFit(capture, scene.motion, errors, scene.markers.model_ground)

    def repaired(self, monkeypatch):
        """What the diagnosis does first."""

        def scenes_of(fit, *_):
            names = [trial.capture.name for trial in fit.trials]
            return [(replace(self.scenes[name][1], name=name), None) for name in names]

        monkeypatch.setattr(marker_causes, "scenes_of", scenes_of)
        return with_markers_repaired(self.fitted, Settings(), {})


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """The short walk's markers with noise, gaps and skin, in two and a half seconds."""
    who = Person(68.0, 1.72)  # that of the short walk
    observed, _ = record_markers(who, Scenario("walk", "walk", duration=2.5, heading_deg=20.0), 4)
    return observed


@pytest.fixture(scope="module")
def spoilt(walk, short_scene) -> np.ndarray:
    """A marker that slips, and a pair that is exchanged later on, to the end."""
    skeleton = short_scene.skeleton
    observed = walk.copy()
    m = skeleton.marker_names.index(SLIPPED)
    R = track(short_scene, walk).R_ground_body[SLIP_FRAME:, skeleton.markers[m].body]
    observed[SLIP_FRAME:, m] += R @ SLIP_M
    pair = [skeleton.marker_names.index(name) for name in SWAPPED]
    observed[SWAP, pair] = walk[SWAP, pair[::-1]]
    return observed


def test_sound_markers_are_fitted_once_and_left_alone(walk, short_scene, monkeypatch):
    laboratory = Laboratory(short_scene, {"walk": walk})
    fit, seen, causes = laboratory.repaired(monkeypatch)
    assert laboratory.asked == [{}]
    assert fit.trials[0].capture is laboratory.captures["walk"]
    assert [f for f in causes.findings if f.id in ("marker_slip", "marker_swap")] == []
    assert causes.marker_rms_before_m == causes.marker_rms_after_m > 0
    assert [scene.name for scene, _ in seen] == ["walk"]


def test_what_one_repair_uncovers_is_repaired_next(walk, spoilt, short_scene, monkeypatch):
    """The exchanged pair first, then the slip; the sound trial keeps its recording."""
    skeleton = short_scene.skeleton
    laboratory = Laboratory(short_scene, {"sound": walk, "spoilt": spoilt})
    fit, _, causes = laboratory.repaired(monkeypatch)
    assert [sorted(asked) for asked in laboratory.asked] == [[], ["spoilt"], ["spoilt"]]
    first, second = [f for f in causes.findings if f.id.startswith("marker")]
    assert (first.id, set(first.target.split("+"))) == ("marker_swap", set(SWAPPED))
    assert (second.id, second.target) == ("marker_slip", SLIPPED)
    assert {first.frames.trial, second.frames.trial} == {"spoilt"}
    assert causes.marker_rms_after_m < causes.marker_rms_before_m
    sound, corrected = fit.trials
    assert sound.capture is laboratory.captures["sound"]
    names = skeleton.marker_names
    touched = [names.index(name) for name in (SLIPPED, *SWAPPED)]
    error = observed_markers(corrected, skeleton) - walk
    np.testing.assert_array_equal(np.nan_to_num(np.delete(error, touched, axis=1)), 0.0)
    assert np.nanmax(np.linalg.norm(error[SLIP_FRAME + 12 :, touched[0]], axis=1)) < 0.006
    assert np.nanmedian(np.linalg.norm(error[:, touched[1:]], axis=2)) == 0.0


@pytest.mark.parametrize(("loose", "told"), [("WAND", [("marker_slip", "WAND")]), ("F_ForcePlate1", [])])
def test_of_points_that_the_model_lacks_only_markers_are_told(walk, short_scene, monkeypatch, loose, told):
    """A plate's centre of pressure leaps from one step to the next."""
    laboratory = Laboratory(short_scene, {"walk": walk})
    markers = laboratory.captures["walk"].markers
    markers.positions_ground[SLIP_FRAME:, 0] += 0.2
    laboratory.captures["walk"] = Capture("walk", replace(markers, names=(loose, *markers.names[1:])))
    findings = laboratory.repaired(monkeypatch)[2].findings
    assert [(f.id, f.target) for f in findings if f.id == "marker_slip"] == told


def test_a_marker_that_the_model_lacks_stays_as_recorded(spoilt, short_scene, monkeypatch):
    laboratory = Laboratory(short_scene, {"spoilt": spoilt})
    fit, _, _ = laboratory.repaired(monkeypatch)
    recorded, corrected = laboratory.captures["spoilt"].markers, fit.trials[0].capture.markers
    assert corrected.names == recorded.names
    np.testing.assert_array_equal(corrected.positions_ground[:, 0], recorded.positions_ground[:, 0])


def test_it_ends_where_repairs_do_not_help(spoilt, short_scene, monkeypatch):
    laboratory = Laboratory(short_scene, {"spoilt": spoilt}, obeys=False)
    laboratory.repaired(monkeypatch)
    assert len(laboratory.asked) == 1 + ROUNDS


FRAME = 40


@pytest.fixture
def thigh(short_scene):
    """Names of the right thigh's markers; the first one seems to slip."""
    own = np.flatnonzero(short_scene.markers.body == short_scene.skeleton.body_index("femur_r"))
    return [short_scene.markers.names[m] for m in own]


@pytest.fixture
def slipped(short_scene, thigh):
    return slip(short_scene, short_scene.markers.names.index(thigh[0]), FRAME)


def said(scene, markers, later_s=0.0, trial=None, **nats):
    time_s = scene.motion.start_time + FRAME / scene.rate + later_s
    return Statement(
        "rigid distances",
        "…",
        {About(k): v for k, v in nats.items()},
        {"time_s": time_s, "change_m": 0.031},
        trial=trial or scene.name,
        target="+".join(markers),
    )


def test_those_that_moved_together_are_named_in_place_of_the_one_that_stayed(short_scene, thigh, slipped):
    statement = said(short_scene, [*thigh[1:], "WAND"], segment=6.0)
    (told,) = as_distances_tell(SeenInMarkers((slipped,)), [statement], [short_scene]).findings
    assert isinstance(told, SegmentDisplaced)
    assert told.target == "femur_r"
    assert told.parameters["shift_m"].value == 0.031
    assert told.frames == slipped.frames
    observed = short_scene.markers.observed_ground
    np.testing.assert_array_equal(told.repair(observed), slipped.repair(observed))


@pytest.mark.parametrize(
    "statement",
    [
        lambda scene, thigh: said(scene, thigh[1:], segment=4.0),
        lambda scene, thigh: said(scene, thigh[1:], slip=9.0, segment=-1.0),
        lambda scene, thigh: said(scene, thigh[1:], later_s=0.3, segment=9.0),
        lambda scene, thigh: said(scene, thigh[1:], trial="other", segment=9.0),
        lambda scene, thigh: said(scene, thigh, segment=9.0),
        lambda scene, thigh: said(scene, ["WAND", "ROD"], segment=9.0),
    ],
    ids=["too quiet", "of one marker", "later", "in another trial", "with it", "of no marker of the model"],
)
def test_any_other_word_leaves_the_slip(short_scene, thigh, slipped, statement):
    told = as_distances_tell(SeenInMarkers((slipped,)), [statement(short_scene, thigh)], [short_scene])
    assert told.findings == (slipped,)
