"""A synthetic corpus: what its files hold against what is said to be true of them."""

import json
import shutil

import numpy as np
import pytest

from addb_viewer.dataset.build import planned
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_subject import BuildOptions
from addb_viewer.dataset.synthesis.corpus import REASON_OF, CorpusOptions, synthesize, truth_folder
from addb_viewer.dataset.synthesis.movements import Actors, MadeUpPerson
from addb_viewer.jobs.review_store import whole_log
from annotations.events import FlagRange
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.skeleton.pinocchio_model import RigidBodyModel

SMALL = CorpusOptions(4, seed=5, actors=1, activities=("walk",), longest_s=1.0)
FOUND_BY_FITTING = {"no_counting_frames", "no_dynamics", "fit_failed", "erroneous"}


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    place = tmp_path_factory.mktemp("made") / "corpus"
    synthesize(place, SMALL)
    return place


@pytest.fixture(scope="module")
def truth(root):
    return json.loads((truth_folder(root) / "truth.json").read_text(encoding="utf-8"))


def test_a_scan_leaves_out_what_is_said_to_be_left_out(root, truth):
    plan = planned([root], BuildOptions())
    found = {(row.level, row.id, row.reason) for row in plan.left_out}
    said = {(row["level"], row["id"], row["reason"]) for row in truth["left_out"]}
    later = {row for row in said if row[2] in FOUND_BY_FITTING or row[0] == "segment"}
    assert found == said - later
    assert len(later) == 5
    assert {row["trap"] for row in truth["left_out"]} == {*REASON_OF, "static"}
    good = {one["subject_id"] for one in truth["subjects"] if one["trap"] is None}
    assert {one.who.subject_id for one in plan.wanted} == good | {"Cove 2016/S003"}  # whose fit fails


def test_recorded_forces_are_the_true_ones_but_for_the_steps_that_reviewers_flag(root, truth):
    flagged_in = []
    for about in truth["subjects"][:4]:
        folder = root / about["place"]
        subject = open_subject(folder)
        (files,) = [one for one in subject.trials if one.name == "walk_1"]
        capture = read_trial(files, mass_kg=subject.mass_kg)
        true = np.load(truth_folder(root) / about["place"] / "walk_1.npz")
        times = true["time_s"]
        assert len(times) == capture.markers.frames
        plates = sum(np.interp(times, p.times, np.nan_to_num(p.force_ground[:, 1])) for p in capture.plates)
        lacking = true["wrench_ground"][:, :, 1].sum(axis=1) - plates
        flagged = np.zeros((len(times), 2), dtype=bool)
        for edit in whole_log(folder).about("walk_1").edits:
            if isinstance(edit.event, FlagRange):
                flagged[edit.event.start : edit.event.end, "rl".index(edit.event.foot[-1])] = True
        without = (true["wrench_ground"][:, :, 1] * flagged).sum(axis=1)
        delay = 0.05 * about["mass_kg"] * 9.81 if "late_clock" in about["faults"] else 40.0
        away = np.abs(lacking - without)
        assert np.quantile(away, 0.9) < delay, about["subject_id"]
        if flagged.any():
            flagged_in.append(about["faults"])
    assert flagged_in == [["off_plate"]]


def test_people_differ_and_nothing_in_a_folder_tells_that_it_was_made(root, truth):
    people = [one for one in truth["subjects"] if one["trap"] is None]
    assert len({one["mass_kg"] for one in people}) == len(people)
    assert len({one["person_id"].split("/")[0] for one in people}) == 4
    for path in root.rglob("*"):
        if path.is_file() and path.suffix != ".sqlite":
            text = path.read_text(encoding="utf-8").lower()
            assert not any(word in text for word in ("trap", "truth", "synth", "simulat")), path


def test_the_same_seed_gives_the_same_recordings(root, tmp_path):
    again = tmp_path / "corpus"
    synthesize(again, SMALL)
    files = [p.relative_to(root) for p in sorted(root.rglob("*")) if p.is_file()]
    assert [p.relative_to(again) for p in sorted(again.rglob("*")) if p.is_file()] == files
    for path in files:
        if path.suffix == ".sqlite":
            assert whole_log((root / path).parent).edits == whole_log((again / path).parent).edits
        else:
            assert (root / path).read_bytes() == (again / path).read_bytes(), path


def test_a_folder_that_is_not_empty_is_left_alone(root, tmp_path):
    with pytest.raises(ReleaseError, match="is not empty"):
        synthesize(root, SMALL)
    shutil.copytree(truth_folder(root), tmp_path / "other.truth")
    with pytest.raises(ReleaseError, match=r"other\.truth: is not empty"):
        synthesize(tmp_path / "other", SMALL)
    assert not (tmp_path / "other").exists()


def test_a_second_session_is_of_the_same_person_with_markers_put_on_anew(tmp_path):
    place = tmp_path / "corpus"
    options = CorpusOptions(6, traps=False, actors=1, activities=("walk",), longest_s=0.5)
    synthesize(place, options)
    told = json.loads((truth_folder(place) / "truth.json").read_text(encoding="utf-8"))["subjects"]
    first, second = told[-2:]
    assert first["person_id"] == second["person_id"]
    assert first["segment_masses_kg"] == second["segment_masses_kg"]
    apart = []
    for about in (first, second):
        (files,) = open_subject(place / about["place"]).trials
        markers = read_trial(files).markers
        hip, knee = (markers.positions_ground[:, markers.names.index(name)] for name in ("RTH1", "RKNE"))
        apart.append(np.nanmean(np.linalg.norm(hip - knee, axis=1)))
    assert abs(apart[0] - apart[1]) > 0.003


def test_people_may_have_bodies_speeds_and_gaits_of_their_own():
    people = [MadeUpPerson("female", 30.0, height, mass) for height, mass in ((1.52, 47.0), (1.74, 80.0))]

    def worn(actors):
        rng = np.random.default_rng(8)
        return [actors.wearer(person, rng) for person in people]

    def thigh_to_shank(who):
        joints, index = who.body.skeleton.joints, who.body.skeleton.body_index
        thigh, shank = (np.linalg.norm(joints[index(name)].p_parent_frame) for name in ("tibia_r", "talus_r"))
        return thigh / shank

    alike = [thigh_to_shank(who) for who in worn(Actors(1, seed=3))]
    assert alike[0] == pytest.approx(alike[1])
    actors = Actors(None, seed=3, longest_s=0.6)
    wearers = worn(actors)
    own = [thigh_to_shank(who) for who in wearers]
    assert abs(own[0] / own[1] - 1) > 0.005
    assert [who.body.skeleton.mass for who in wearers] == pytest.approx([47.0, 80.0])
    first, again = (actors.movement(wearers[1], "walk", take) for take in (0, 1))
    assert first.scenario.speed != pytest.approx(again.scenario.speed, rel=0.01)
    other = actors.movement(wearers[0], "walk")
    assert first.scenario.cadence != other.scenario.cadence
    assert first.scenario.style.step_width != other.scenario.style.step_width
    for trial in (first, again, other):
        times = np.arange(0, trial.scenario.duration, 0.02)
        # Newton by the centre of mass alone, whose path the foot forces do not enter.
        model = RigidBodyModel(trial.body.skeleton)
        step = 1e-3
        ahead, here, behind = (
            model.centre_of_mass(trial.motion.derivative(times + k * step, 0)) for k in (1, 0, -1)
        )
        required = trial.body.skeleton.mass * ((ahead - 2 * here + behind) / step**2 + (0, 9.80665, 0))
        pushed = trial.reactions(times).force_ground.sum(axis=1)
        np.testing.assert_allclose(pushed, required, atol=0.02 * trial.body.skeleton.mass * 9.81)


def test_another_take_is_other_steps_and_no_second_session_is_made(tmp_path):
    options = CorpusOptions(
        2, traps=False, actors=None, activities=("squat",), longest_s=0.4, takes=2, faults=False
    )
    synthesize(tmp_path / "corpus", options)
    told = json.loads((truth_folder(tmp_path / "corpus") / "truth.json").read_text(encoding="utf-8"))
    first = told["subjects"][0]
    assert [trial["name"] for trial in first["trials"]] == ["squat_1", "squat_2"]
    place = truth_folder(tmp_path / "corpus") / first["place"]
    one, other = (np.load(place / f"squat_{k}.npz")["q"] for k in (1, 2))
    assert np.abs(one - other).max() > 1e-3
    assert all(subject["faults"] == [] for subject in told["subjects"])
