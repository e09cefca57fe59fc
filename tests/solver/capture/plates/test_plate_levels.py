"""Signs and zero levels of force plates are those that the whole recording agrees on."""

import shutil
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest

from solver.capture.capture import Capture, ForcePlate, Markers, PlateWord, TrialFiles
from solver.capture.formats.c3d import read_c3d
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.plates.force_platform import plate_axes
from solver.capture.plates.plate_levels import correct_signs_and_levels, evidence_on_plates
from solver.capture.plates.plate_sign import CLEAR_NATS, weigh_signs
from solver.capture.subject.opened_subject import open_subject
from solver.capture.subject.subject_toml import described_as_toml
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError
from solver.fitting.provenance import provenance_of

FOLDERS = {
    "c3d_lab_trials/lasem_FAILT01": ("Walk01", "SLDJ06"),
    "exo_apo_gordon": ("NE21", "ET21"),
    "opencap_subject4": ("DJ1", "STS1", "squats1", "walking1", "walkingTO1"),
    "opencap_subject6": ("walking1",),
    "overground_falisse_AdDB": ("Gait_7",),
    "run_treadmill_hamner2013_subject04": ("run400",),
    "synthetic_arnold2013_subject01": ("trial",),
    "walk_gait2354_subject01": ("walk1",),
    "walk_rajagopal2015": ("walk",),
    "walk_treadmill_stepwidth": ("example1",),
}
FILES = (
    "c3d_lab_trials/opensim_core/aStaticTrial_2.c3d",
    "c3d_lab_trials/opensim_core/doubleLegLanding.c3d",
    "c3d_conformance/c3dorg_sample02/pc_real.c3d",
    "c3d_conformance/c3dorg_sample10/type-2a.c3d",
    "c3d_conformance/btk_others/shd01.c3d",
    "c3d_conformance/btk_others/ADemo1_rewrite_c3d_pc_integer.c3d",
    "c3d_conformance/ezc3d/BTS.c3d",
)
CASES = [*chain.from_iterable(((folder, trial) for trial in trials) for folder, trials in FOLDERS.items())]
CASES += [(file, "") for file in FILES]


@pytest.fixture(scope="module")
def recording(real_data):
    """A recording of the shared data as it is read, with its mass if that was entered."""
    kept: dict[tuple[str, str], tuple[Capture, float | None]] = {}

    def read(place, trial=""):
        if (place, trial) not in kept:
            if trial:
                subject = open_subject(real_data / place)
                files = next(t for t in subject.trials if t.name == trial)
                kept[place, trial] = read_trial(files, mass_kg=subject.mass_kg), subject.mass_kg
            else:
                kept[place, trial] = read_trial(TrialFiles("t", real_data / place)), None
        return kept[place, trial]

    return read


def tared_under(plate: ForcePlate, load_N: float) -> ForcePlate:
    """As if that weight had stood in the middle of the plate while it was tared."""
    loaded = plate.force_ground[:, 1] > 50
    place = np.nanmedian(plate.cop_ground[loaded], axis=0)
    force = np.array([0.0, load_N, 0.0])
    return replace(
        plate,
        force_ground=plate.force_ground - force,
        moment_ground=plate.moment_ground - np.cross(place, force),
    )


def tared_under_z(plate: ForcePlate, load_N: float) -> ForcePlate:
    """The same in axes of which z points up."""
    force = np.array([0.0, 0.0, load_N])
    return replace(
        plate,
        force_ground=plate.force_ground - force,
        moment_ground=plate.moment_ground - np.cross(plate.corners_ground.mean(axis=0), force),
    )


def reversed_(plate: ForcePlate) -> ForcePlate:
    return replace(plate, force_ground=-plate.force_ground, moment_ground=-plate.moment_ground)


def with_plate(plates, k, plate):
    return (*plates[:k], plate, *plates[k + 1 :])


def edits(plates, used):
    """Name, edited plates, and which of them hold the force on the plate."""
    none = frozenset()
    yield "as it is", plates, none
    yield "all on the plate", tuple(reversed_(p) for p in plates), frozenset(used)
    for k in used:
        if len(used) > 1:
            yield f"{k} on the plate", with_plate(plates, k, reversed_(plates[k])), frozenset([k])
        for load in (1000.0, 300.0):
            untared = with_plate(plates, k, tared_under(plates[k], load))
            yield f"{k} tared under {load:g} N", untared, none
            both = with_plate(untared, k, reversed_(untared[k]))
            yield f"{k} tared under {load:g} N and on the plate", both, frozenset([k])
            every = tuple(reversed_(p) for p in untared)
            yield f"{k} tared under {load:g} N, all on the plate", every, frozenset(used)


@pytest.mark.slow
@pytest.mark.real
@pytest.mark.parametrize(("place", "trial"), CASES)
def test_no_right_plate_is_turned_and_no_wrong_one_left_without_a_word(recording, place, trial):
    capture, mass_kg = recording(place, trial)
    judged = evidence_on_plates(capture.plates, capture.markers, mass_kg)
    used = [k for k, evidence in enumerate(judged) if evidence.used]
    assert used
    decided = total = 0
    for name, plates, on_plate in edits(capture.plates, used):
        settled, notes = correct_signs_and_levels(plates, capture.markers, mass_kg)
        for k in used:
            turned = np.nansum((settled[k].force_ground - plates[k].force_ground).std(axis=0)) > 1
            told = any(note.startswith(f"{plates[k].name}: ") for note in notes)
            assert not turned or k in on_plate, f"{name}: plate {k} was right and is turned"
            assert turned or k not in on_plate or told, f"{name}: plate {k} is wrong and left without a word"
            total += 1
            decided += turned == (k in on_plate)
    assert decided >= 0.5 * total


def contradictions(markers: Markers, mass_kg: float | None):
    """Markers and masses that do not belong to the forces: of another clock, run backwards, unseen."""
    yield "a heavier person", markers, 1.6 * (mass_kg or 70)
    yield "a lighter person", markers, 0.6 * (mass_kg or 70)
    yield "late", replace(markers, start_time=markers.start_time + 0.3), mass_kg
    yield "early", replace(markers, start_time=markers.start_time - 0.25), mass_kg
    yield "backwards", replace(markers, positions_ground=markers.positions_ground[::-1]), mass_kg
    nowhere = np.full_like(markers.positions_ground, np.nan)
    yield "unseen", replace(markers, positions_ground=nowhere), mass_kg


@pytest.mark.real
@pytest.mark.parametrize(("place", "trial"), CASES)
def test_markers_or_a_mass_that_do_not_belong_change_no_plate(recording, place, trial):
    capture, mass_kg = recording(place, trial)
    for name, markers, mass in contradictions(capture.markers, mass_kg):
        settled, _ = correct_signs_and_levels(capture.plates, markers, mass)
        assert all(a is b for a, b in zip(settled, capture.plates, strict=True)), name


@pytest.mark.real
@pytest.mark.parametrize(
    ("place", "trial"),
    [("c3d_lab_trials/lasem_FAILT01", "Walk01"), ("run_treadmill_hamner2013_subject04", "run400")],
)
def test_a_load_that_stood_on_the_plate_while_it_was_tared_is_put_back(recording, place, trial):
    capture, mass_kg = recording(place, trial)
    for edited in (lambda p: tared_under(p, 1000.0), lambda p: reversed_(tared_under(p, 300.0))):
        settled, notes = correct_signs_and_levels(
            [edited(capture.plates[0]), *capture.plates[1:]], capture.markers, mass_kg
        )
        np.testing.assert_allclose(settled[0].force_ground, capture.plates[0].force_ground, atol=3)
        np.testing.assert_allclose(settled[0].moment_ground, capture.plates[0].moment_ground, atol=3)
        assert any("zero level is off" in note and "taken off" in note for note in notes), notes


@pytest.mark.real
@pytest.mark.parametrize("file", ["doubleLegLanding.c3d", "aStaticTrial_2.c3d"])
def test_a_file_whose_first_plate_was_tared_under_a_kilonewton(
    real_data, tmp_path, write_c3d, plate_of, file
):
    """The landing's forces come back whole; in a second of standing nothing tells, so nothing is changed."""
    original = read_c3d(real_data / "c3d_lab_trials/opensim_core" / file)
    raw = [tared_under_z(p, 1000.0) if k == 0 else p for k, p in enumerate(original.plates[:2])]
    channels = []
    for plate in raw:
        R_lab_plate = plate_axes(plate.corners_ground)
        centre = plate.corners_ground.mean(axis=0)
        moment = plate.moment_ground - np.cross(centre, plate.force_ground)
        wrench = np.hstack([plate.force_ground @ R_lab_plate, 1000 * moment @ R_lab_plate])
        units = ("N",) * 3 + ("Nmm",) * 3
        channels.append(plate_of(2, wrench, plate.corners_ground * 1000, units=units))
    markers = original.markers
    path = write_c3d(
        tmp_path / file,
        markers.positions_ground * 1000,
        markers.names,
        rate=markers.rate,
        plates=channels,
        samples_per_frame=round(raw[0].rate / markers.rate),
    )
    capture = read_trial(TrialFiles("t", path))
    assert not any("sign is turned" in note for note in capture.notes), capture.notes
    vertical = capture.plates[0].force_ground[:, 1]
    if "Landing" in file:
        np.testing.assert_allclose(vertical, original.plates[0].force_ground[:, 2], atol=5)
        assert any("zero level is off" in note for note in capture.notes)
    else:
        np.testing.assert_allclose(vertical, raw[0].force_ground[:, 2], atol=0.1)
        assert any("plate 1: the sign of its force cannot be determined" in note for note in capture.notes)


@pytest.mark.real
def test_a_plate_tared_under_a_kilonewton_is_not_turned_in_quiet_standing(recording):
    """It reads -820 N throughout, on one second of standing."""
    capture, _ = recording("c3d_lab_trials/opensim_core/aStaticTrial_2.c3d")
    first = tared_under(capture.plates[0], 1000.0)
    settled, notes = correct_signs_and_levels([first, *capture.plates[1:]], capture.markers)
    assert settled[0] is first
    assert any(note.startswith(f"{first.name}: ") for note in notes), notes


def standing(seconds=6.0, rate=100.0, sway_N=25.0):
    """Weight shifted slowly between two plates by 65 kg; the trunk hardly moves up and down."""
    rng = np.random.default_rng(3)
    times = np.arange(0, seconds, 1 / rate)
    shift = sway_N * (np.sin(2.1 * times) + 0.6 * np.sin(5.3 * times + 1))
    loads = np.stack([320 + shift, 317.4 - shift], axis=1) + rng.normal(0, 1.0, (len(times), 2))
    heights = np.array([0.05, 0.05, 0.95, 1.0, 1.02, 1.3, 1.4])
    positions = np.zeros((len(times), len(heights), 3))
    positions[:, :, 1] = heights + rng.normal(0, 2e-4, (len(times), len(heights)))
    names = ("heel_r", "heel_l", "sacrum", "asis_r", "asis_l", "clavicle", "C7")
    plates = []
    for k, x in enumerate((0.2, -0.2)):
        force = np.zeros((len(times), 3))
        force[:, 1] = loads[:, k]
        centre = np.tile([x, 0.0, 0.0], (len(times), 1))
        plates.append(ForcePlate(f"fp{k + 1}", force, np.cross(centre, force), centre, rate))
    return tuple(plates), Markers(names, positions, rate)


def test_quiet_standing_does_not_turn_a_plate_tared_under_load():
    """Both plates count alike, that is certain; whether as they are or turned is what nothing here tells."""
    plates, markers = standing()
    tared = (tared_under(plates[0], 1000.0), plates[1])
    settled, notes = correct_signs_and_levels(tared, markers)
    assert all(a is b for a, b in zip(settled, tared, strict=True))
    evidence_by_plate = evidence_on_plates(tared, markers)
    assert [evidence.sign for evidence in evidence_by_plate] == [1, 1]
    assert [note[:4] for note in notes] == ["fp1:", "fp2:"]
    assert all("cannot be determined" in note for note in notes)


def test_weight_that_comes_and_goes_tells_that_a_plate_tared_under_load_counts_the_right_way():
    """Three squats on the same plates: where the trunk speeds up, the plates' sum grows."""
    plates, markers = standing()
    times, rate = markers.times, markers.rate
    depth = 0.12 * (1 - np.cos(2 * np.pi * 0.6 * times)) / 2
    moved = markers.positions_ground.copy()
    moved[:, 2:, 1] -= depth[:, None]
    pushed = -65 * 0.75 * np.gradient(np.gradient(depth, 1 / rate), 1 / rate)
    squatting = []
    for plate in plates:
        force = plate.force_ground + 0.5 * pushed[:, None] * [0, 1, 0]
        squatting.append(replace(plate, force_ground=force, moment_ground=np.cross(plate.cop_ground, force)))
    tared = (tared_under(squatting[0], 1000.0), squatting[1])
    settled, notes = correct_signs_and_levels(tared, replace(markers, positions_ground=moved))
    assert all(a is b for a, b in zip(settled, tared, strict=True))
    assert any("fp1: its zero level is off" in note and "nothing is taken off" in note for note in notes)
    first, second = evidence_on_plates(tared, replace(markers, positions_ground=moved))
    assert min(first.sign_nats, second.sign_nats) > CLEAR_NATS


def stepping(held_N, rest_s):
    """Three squats on two plates; for a while nobody is on the first, whose samples a program then holds."""
    plates, markers = standing()
    times, rate = markers.times, markers.rate
    depth = 0.12 * (1 - np.cos(2 * np.pi * 0.6 * times)) / 2
    moved = markers.positions_ground.copy()
    moved[:, 2:, 1] -= depth[:, None]
    total = 65 * (9.80665 - 0.75 * np.gradient(np.gradient(depth, 1 / rate), 1 / rate))
    away = (times > 1.0) & (times < 1.0 + rest_s)
    loads = np.stack([np.where(away, 0.0, 0.45 * total), np.where(away, total, 0.55 * total)], axis=1)
    filed = []
    for plate, load in zip(plates, loads.T, strict=True):
        force = load[:, None] * [0.0, 1.0, 0.0]
        filed.append(replace(plate, force_ground=force, moment_ground=np.cross(plate.cop_ground, force)))
    level = np.array([0.0, held_N, 0.0])
    first = replace(
        filed[0],
        force_ground=filed[0].force_ground + level,
        moment_ground=filed[0].moment_ground + np.cross(filed[0].cop_ground, level),
    )
    return (first, filed[1]), filed[0], replace(markers, positions_ground=moved)


def test_a_level_held_once_is_taken_off_where_weight_and_motion_ask_for_it():
    """One swing of a treadmill walk: the plate rests once, at a level that no load leaves."""
    plates, true, markers = stepping(held_N=-600.0, rest_s=0.4)
    settled, notes = correct_signs_and_levels(plates, markers, 65.0)
    np.testing.assert_allclose(settled[0].force_ground, true.force_ground, atol=1e-6)
    np.testing.assert_allclose(settled[0].moment_ground, true.moment_ground, atol=1e-6)
    assert any("zero level is off" in note and "-600 N" in note and "taken off" in note for note in notes)


def test_a_reading_held_once_elsewhere_is_no_level():
    """A program that held one loaded value, as over a lost packet, above what the plate reads unloaded."""
    plates, _, markers = stepping(held_N=-600.0, rest_s=0.0)
    stuck = plates[0].force_ground.copy()
    stuck[120:140] = stuck[120] + [0.0, 40.0, 0.0]
    first = replace(plates[0], force_ground=stuck)
    settled, notes = correct_signs_and_levels((first, plates[1]), markers, 65.0)
    assert any("nothing is taken off" in note for note in notes)
    assert settled[0] is first


def test_quiet_standing_tells_which_plate_holds_the_force_on_the_plate():
    plates, markers = standing()
    settled, notes = correct_signs_and_levels((plates[0], reversed_(plates[1])), markers, 65.0)
    np.testing.assert_array_equal(settled[1].force_ground, plates[1].force_ground)
    assert settled[0] is plates[0]
    assert [note[:4] for note in notes] == ["fp2:"]


def test_the_verdict_is_told_in_a_sentence_with_its_evidence():
    plates, markers = standing()
    first, second = evidence_on_plates((plates[0], reversed_(plates[1])), markers, 65.0)
    assert first.sentence().startswith("it reads the force on the person (")
    assert second.sentence().startswith("it reads the force on the plate (")
    unsure, _ = evidence_on_plates((tared_under(plates[0], 1000.0), plates[1]), markers)
    assert "its sign is uncertain" in unsure.sentence()


def test_a_constant_reading_of_one_plate_decides_nothing():
    readings = np.full((60, 1), -700.0)
    nothing = np.zeros(60)
    (evidence,) = weigh_signs(readings, nothing, nothing)
    assert evidence.is_undecided()
    assert not evidence.is_turned()


def test_a_plate_that_nobody_used_is_not_judged():
    plates, markers = standing()
    empty = replace(
        plates[1], force_ground=np.random.default_rng(0).normal(-12, 2, plates[1].force_ground.shape)
    )
    assert not evidence_on_plates([plates[0], empty], markers)[1].used
    assert correct_signs_and_levels([plates[0], empty], markers)[1] == ()


def test_a_recording_shorter_than_the_smoothing_is_left_alone():
    plates, markers = standing()
    brief = [
        replace(
            p, force_ground=p.force_ground[:8], moment_ground=p.moment_ground[:8], cop_ground=p.cop_ground[:8]
        )
        for p in plates
    ]
    settled, _ = correct_signs_and_levels(
        brief, replace(markers, positions_ground=markers.positions_ground[:8])
    )
    assert all(a is b for a, b in zip(settled, brief, strict=True))


def read_reversed(real_data, tmp_path, said):
    """A walk whose second plate holds the force on the plate, and what a subject.toml says of it."""
    table = read_storage(real_data / "walk_gait2354_subject01/subject01_walk1_grf.mot")
    values = table.values.copy()
    turned = [k for k, name in enumerate(table.labels) if name.startswith("1_ground_") and "_p" not in name]
    values[:, turned] *= -1
    write_storage(tmp_path / "walk_grf.mot", table.labels, table.times, values)
    shutil.copyfile(real_data / "walk_gait2354_subject01/subject01_walk1.trc", tmp_path / "walk.trc")
    (tmp_path / "subject.toml").write_text(
        f'mass_kg = 72.6\n[trials.walk]\nmarkers = "walk.trc"\nforces = "walk_grf.mot"\n{said}'
    )
    (files,) = open_subject(tmp_path).trials
    return read_trial(files, mass_kg=72.6)


@pytest.mark.real
def test_a_person_says_which_way_a_plate_counts(real_data, tmp_path):
    by_itself = read_reversed(real_data, tmp_path, "")
    names = [plate.name for plate in by_itself.plates]
    assert np.nanmin(by_itself.plates[1].force_ground[:, 1]) > -50  # turned, since the recording tells
    said = f'[trials.walk.plates."{names[1]}"]\nreads = "person"\n'
    capture = read_reversed(real_data, tmp_path, said)
    assert np.nanmin(capture.plates[1].force_ground[:, 1]) < -700
    np.testing.assert_array_equal(capture.plates[0].force_ground, by_itself.plates[0].force_ground)
    (note,) = [note for note in capture.notes if "as subject.toml says" in note]
    assert names[1] in note
    assert "the recording alone: it reads the force on the plate" in note
    assert "its readings contradict that" in note
    said = said.replace("person", "plate")
    turned = read_reversed(real_data, tmp_path, said)
    assert not [note for note in turned.notes if "speaks against" in note]
    np.testing.assert_allclose(turned.plates[1].force_ground, by_itself.plates[1].force_ground)


@pytest.mark.real
def test_a_person_says_a_zero_level(recording, real_data, tmp_path):
    """Squats, on which the plates never rest: nothing in the recording would allow taking it off."""
    capture, mass_kg = recording("opencap_subject4", "squats1")
    plates = with_plate(capture.plates, 0, tared_under(capture.plates[0], 300.0))
    name = plates[0].name
    left, _ = correct_signs_and_levels(plates, capture.markers, mass_kg)
    assert np.nanmedian(left[0].force_ground[:, 1] - plates[0].force_ground[:, 1]) == pytest.approx(0, abs=1)
    word = PlateWord(name, zero_N=-300.0)
    settled, notes = correct_signs_and_levels(plates, capture.markers, mass_kg, said=[word])
    np.testing.assert_allclose(settled[0].force_ground[:, 1], capture.plates[0].force_ground[:, 1], atol=1e-9)
    loaded = capture.plates[0].force_ground[:, 1] > 100
    off_m = np.linalg.norm(settled[0].cop_ground - capture.plates[0].cop_ground, axis=1)[loaded]
    assert np.nanmedian(off_m) < 0.02
    assert any(
        f"{name}: as subject.toml says, unloaded it reads -300 N, which is taken off" in n for n in notes
    )


@pytest.mark.real
def test_zero_newtons_keeps_a_plate_whatever_the_recording_tells(recording):
    capture, mass_kg = recording("walk_gait2354_subject01", "walk1")
    plates = with_plate(capture.plates, 0, tared_under(capture.plates[0], 200.0))
    lowered, _ = correct_signs_and_levels(plates, capture.markers, mass_kg)
    assert np.nanmedian((lowered[0].force_ground - plates[0].force_ground)[:, 1]) > 150
    kept, _ = correct_signs_and_levels(
        plates, capture.markers, mass_kg, said=[PlateWord(plates[0].name, 1, 0.0)]
    )
    np.testing.assert_array_equal(kept[0].force_ground, plates[0].force_ground)


@pytest.mark.real
def test_a_word_about_a_plate_that_is_not_there_names_those_that_are(real_data, tmp_path):
    with pytest.raises(
        CaptureError, match=r"walk_grf\.mot: .*plate 'FP7', but the recording's plates are gr"
    ):
        read_reversed(real_data, tmp_path, '[trials.walk.plates.FP7]\nreads = "plate"\n')


@pytest.mark.parametrize(
    ("said", "wrong"),
    [
        ('plates = "left"', "plates are tables of their own"),
        ('[trials.walk.plates.FP1]\nreads = "up"', "choose one of person, plate"),
        ("[trials.walk.plates.FP1]\nzero_N = true", "a number of newtons"),
        ("[trials.walk.plates.FP1]\nzero_N = nan", "a number of newtons"),
        ("[trials.walk.plates.FP1]\nsign = -1", "no other keys than reads and zero_N"),
    ],
)
def test_words_that_say_nothing_are_refused(tmp_path, said, wrong):
    (tmp_path / "walk.trc").write_text("")
    (tmp_path / "subject.toml").write_text(f'[trials.walk]\nmarkers = "walk.trc"\n{said}\n')
    with pytest.raises(CaptureError, match=wrong):
        open_subject(tmp_path)


def test_what_was_said_is_written_again_and_is_part_of_the_provenance(tmp_path):
    (tmp_path / "walk.trc").write_text("x")
    (tmp_path / "subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
    silent = open_subject(tmp_path)
    assert "# zero_N = 0.0" in described_as_toml(silent)
    said = '[trials.walk.plates."1 ground"]\nreads = "plate"\nzero_N = -12.5\n'
    (tmp_path / "subject.toml").write_text(f'[trials.walk]\nmarkers = "walk.trc"\n{said}')
    subject = open_subject(tmp_path)
    assert subject.trials[0].plates == (PlateWord("1 ground", -1, -12.5),)
    (tmp_path / "subject.toml").write_text(described_as_toml(subject))
    assert open_subject(tmp_path).trials == subject.trials
    assert provenance_of(subject, subject.trials) != provenance_of(silent, silent.trials)
    upright = (replace(silent.trials[0], up="z"),)
    assert provenance_of(silent, upright) != provenance_of(silent, silent.trials)
