import json
from dataclasses import fields

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.simulate.demo_subject import LateForces, write_demo_subject

WALK = ("static", "walk")


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("someone")
    return folder, write_demo_subject(folder, np.random.default_rng(3), trials=WALK)


def files_of(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_is_an_ordinary_subject_folder(demo):
    folder, _ = demo
    assert files_of(folder) == [
        "_subject.json",
        "trials/static/markers.trc",
        "trials/walk/grf.mot",
        "trials/walk/markers.trc",
    ]
    subject = open_subject(folder)
    assert subject.model is None
    assert subject.static is not None
    assert [trial.name for trial in subject.trials] == ["walk"]
    assert subject.mass_kg == pytest.approx(71.0)


def test_tells_nothing_of_the_truth(demo):
    folder, _ = demo
    assert set(json.loads((folder / "_subject.json").read_text())) == {
        "massKg",
        "heightM",
        "sex",
        "footBodyNames",
    }
    for path in folder.rglob("*"):
        if path.is_file():
            text = path.read_text().lower()
            words = ("truth", "synth", "simul", "demo", "off_plate", "seed", "delay", "late", "offset")
            assert not any(word in text for word in words)


def test_reads_back_as_it_was_measured(demo):
    folder, truth = demo
    capture = read_trial(open_subject(folder).trials[0])
    trial = truth.trials[1]
    times = capture.plates[0].times
    feet = trial.reactions(times).force_ground.sum(axis=1)
    _, since, until = truth.off_plate["walk"][0]
    covered = (times < since - 0.02) | (times > until + 0.02)
    measured = sum(plate.force_ground for plate in capture.plates)
    difference = (measured - feet)[covered]
    assert np.sqrt(np.mean(difference**2)) < 4.0
    assert capture.markers.rate == 100.0
    assert capture.markers.frames == 401
    assert len(read_static(open_subject(folder).static).markers.names) > 50


def test_one_step_in_the_middle_is_missing(demo):
    folder, truth = demo
    capture = read_trial(open_subject(folder).trials[0])
    times = capture.plates[0].times
    assert len(truth.off_plate["walk"]) == 1
    foot, since, until = truth.off_plate["walk"][0]
    assert foot in ("calcn_r", "calcn_l")
    assert 0.3 < since < until < 3.7
    total = sum(plate.force_ground[:, 1] for plate in capture.plates)
    middle = np.abs(times - (since + until) / 2) < 0.05
    assert np.abs(total[middle]).max() < 20
    assert truth.trials[1].reactions(times[middle]).force_ground[..., 1].sum(axis=1).min() > 400


def test_the_same_generator_writes_the_same_files(demo, tmp_path):
    folder, _ = demo
    write_demo_subject(tmp_path / "again", np.random.default_rng(3), trials=WALK)
    for name in files_of(folder):
        assert (folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_leaving_a_trial_out_does_not_change_the_others(demo, tmp_path):
    folder, _ = demo
    write_demo_subject(tmp_path / "less", np.random.default_rng(3), trials=("static",))
    name = "trials/static/markers.trc"
    assert (folder / name).read_bytes() == (tmp_path / "less" / name).read_bytes()


def test_late_forces_are_the_same_forces_later(demo, tmp_path):
    """The delay is a whole number of samples here: what the plates saw moves by it, sample by sample."""
    folder, truth = demo
    assert truth.cause is None
    late = tmp_path / "late"
    told = write_demo_subject(late, np.random.default_rng(3), trials=WALK, cause=LateForces(0.010))
    assert told.cause == LateForces(0.010)
    for trial in WALK:
        name = f"trials/{trial}/markers.trc"
        assert (folder / name).read_bytes() == (late / name).read_bytes()
    prompt, delayed = (read_trial(open_subject(f).trials[0]).plates for f in (folder, late))
    differences = []
    for before, after in zip(prompt, delayed, strict=True):
        both = (before.force_ground[:-10, 1] > 50) & (after.force_ground[10:, 1] > 50)
        differences.append((after.force_ground[10:] - before.force_ground[:-10])[both])
    of_noise = np.sqrt(2) * np.array([0.8, 1.5, 0.8])  # two independent readings of one force
    assert np.concatenate(differences).std(axis=0) == pytest.approx(of_noise, rel=0.05)
    assert files_of(late) == files_of(folder)


def test_truth_is_given_to_the_caller(demo):
    _, truth = demo
    assert {f.name for f in fields(truth)} >= {"person", "body", "trials", "plates", "off_plate"}
    assert [trial.scenario.name for trial in truth.trials] == list(WALK)
