"""Arrays become recordings as they are: nothing is guessed, and what contradicts itself is refused."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer import Plate, Recording, SolverError, Subject

GROUND_FROM_Z_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # x stays, z up becomes y up


def same(read, given):
    np.testing.assert_allclose(read.markers, given.markers, atol=1e-9)
    assert list(read.marker_names) == list(given.marker_names)
    np.testing.assert_allclose(read.times, given.times, atol=1e-9)
    for got, plate in zip(read.plates, given.plates, strict=True):
        moment = np.cross(plate.centre_of_pressure, plate.force) + plate.free_moment
        np.testing.assert_allclose(got.times, plate.times, atol=1e-9)
        np.testing.assert_allclose(got.force, plate.force, atol=1e-8)
        np.testing.assert_allclose(got.moment, moment, atol=1e-8)
        np.testing.assert_allclose(got.centre_of_pressure, plate.centre_of_pressure, atol=1e-9)


def opened(recording, **more):
    return Subject.from_recordings({"walk": recording}, **more)


def test_the_solver_reads_what_was_given(walk):
    subject = opened(walk, mass_kg=71.5, height_m=1.7, sex="female")
    assert (subject.trials, subject.mass_kg, subject.height_m) == (("walk",), 71.5, 1.7)
    same(subject.recording("walk"), walk)


def test_markers_at_zero_or_heaped_into_one_point_are_not_seen(walk):
    markers = np.array(walk.markers)
    markers[3, 0] = 0.0
    markers[5] = markers[5, 0]
    read = opened(replace(walk, markers=markers)).recording("walk")
    assert np.isnan(read.markers[3, 0]).all()
    assert np.isnan(read.markers[5]).all()
    same(replace(read, markers=read.markers[6:]), replace(walk, markers=walk.markers[6:]))


def test_from_arrays_is_a_recording_of_one_trial(walk):
    arrays = walk.markers, walk.marker_names, walk.times
    subject = Subject.from_arrays(*arrays, plates=walk.plates, name="Gehen: 1. Mal")
    assert subject.trials == ("Gehen: 1. Mal",)
    same(subject.recording("Gehen: 1. Mal"), walk)
    with pytest.raises(SolverError, match="leave out / and"):
        Subject.from_arrays(*arrays, name="a/b")


def test_z_up_is_turned_and_stays_right_handed(walk):
    R = GROUND_FROM_Z_UP

    def in_lab(vectors):
        return vectors @ R  # the inverse of the turn to y up

    (plate,) = walk.plates
    moment = np.cross(plate.centre_of_pressure, plate.force) + plate.free_moment
    lab_plate = Plate(in_lab(plate.force), plate.times, moment=in_lab(moment))
    lab = Recording(in_lab(walk.markers), walk.marker_names, walk.times, (lab_plate,), up="z")
    read = opened(lab).recording("walk")
    same(read, walk)


def test_a_plate_without_free_moment_has_none(walk):
    (plate,) = walk.plates
    bare = replace(walk, plates=(replace(plate, free_moment=None),))
    (read,) = opened(bare).recording("walk").plates
    np.testing.assert_allclose(read.moment, np.cross(plate.centre_of_pressure, plate.force), atol=1e-8)


def plate_with(walk, **changes):
    return replace(walk, plates=(replace(walk.plates[0], **changes),))


WRONG = {
    "millimetres": (lambda w: replace(w, markers=1000 * w.markers), "metres are needed. They look like mm"),
    "another axis up": (lambda w: replace(w, up="z"), r'\+y points up .*Give up="y"'),
    "upside down": (lambda w: replace(w, up="-y"), r'\+y points up .*Give up="y"'),
    "no such axis": (lambda w: replace(w, up="up"), "no such axis"),
    "force on the plate": (lambda w: plate_with(w, force=-w.plates[0].force), "give the force on the person"),
    "one frame's shape": (
        lambda w: replace(w, markers=w.markers[0]),
        r"shape \[7, 3\]; \[frames, markers, 3\]",
    ),
    "a name too few": (lambda w: replace(w, marker_names=w.marker_names[1:]), "6 marker_names for 7 markers"),
    "a name twice": (lambda w: replace(w, marker_names=("C7",) * 7), "none twice"),
    "times of other frames": (lambda w: replace(w, times=w.times[1:]), r"times: shape \[100\]; \[101\]"),
    "a jump in time": (
        lambda w: replace(w, times=np.where(w.times > 0.5, w.times + 0.1, w.times)),
        "not uniform",
    ),
    "time runs back": (lambda w: replace(w, times=w.times[::-1]), "must be finite and increase"),
    "infinite": (lambda w: replace(w, markers=w.markers / 0.0), "infinite values"),
    "texts": (lambda w: replace(w, markers=np.full((101, 7, 3), "x")), "not an array of numbers"),
    "moments in two ways": (lambda w: plate_with(w, moment=w.plates[0].force), "not both"),
    "nowhere": (
        lambda w: plate_with(w, centre_of_pressure=None, free_moment=None),
        "give the moment about the origin, or the centre_of_pressure",
    ),
    "moments of other samples": (
        lambda w: plate_with(w, free_moment=w.plates[0].force[1:]),
        r"free_moment: shape \[1000, 3\]; \[1001, 3\]",
    ),
    "plates on two clocks": (
        lambda w: replace(w, plates=(w.plates[0], replace(w.plates[0], times=w.plates[0].times + 0.1))),
        "plates have different times",
    ),
}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # the division that makes infinities
@pytest.mark.parametrize("case", WRONG)
def test_what_contradicts_itself_is_refused_with_what_to_do(case, walk):
    change, says = WRONG[case]
    with pytest.raises(SolverError, match=says):
        opened(change(walk))


def test_whoever_is_sure_may_skip_the_checks_of_units_axes_and_signs(walk):
    same(opened(replace(walk, up="y"), check=False).recording("walk"), walk)
    assert opened(replace(walk, up="z"), check=False).trials == ("walk",)


@pytest.mark.parametrize(
    ("person", "says"),
    [
        ({"mass_kg": 71_500}, "mass_kg = 71500"),
        ({"height_m": 170}, "height_m = 170"),
        ({"sex": "f"}, "sex = 'f'"),
    ],
)
def test_a_person_in_other_units_is_refused(walk, person, says):
    with pytest.raises(SolverError, match=says):
        opened(walk, **person)


def test_no_recording_is_no_subject():
    with pytest.raises(SolverError, match="no recordings"):
        Subject.from_recordings({})


def test_a_static_trial_and_a_model_come_along(walk, tmp_path):
    model = tmp_path / "own.osim"
    model.write_text("<OpenSimDocument/>")
    subject = opened(walk, static=walk, model=model, folder=tmp_path / "subject")
    description = (tmp_path / "subject" / "subject.toml").read_text()
    assert subject.trials == ("walk",)
    assert 'static = "static.trc"' in description
    assert 'model = "own.osim"' in description


def test_a_folder_of_ones_own_is_not_written_over(walk, tmp_path):
    (tmp_path / "walk.trc").write_text("somebody's")
    with pytest.raises(SolverError, match="holds other files"):
        opened(walk, folder=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["walk.trc"]


def test_the_same_call_again_writes_its_folder_anew(walk, tmp_path):
    place = tmp_path / "subject"
    opened(walk, folder=place)
    nearer = replace(walk, markers=walk.markers + 0.001)
    same(opened(nearer, folder=place).recording("walk"), nearer)


def test_a_temporary_folder_goes_with_its_subject(walk):
    subject = opened(walk)
    place = subject.folder
    assert place.is_dir()
    del subject
    assert not place.exists()
