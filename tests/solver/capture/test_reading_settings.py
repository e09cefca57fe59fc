"""Each table of reading reaches the place where it decides: a changed value changes what is read."""

from dataclasses import fields, replace

import numpy as np
import pytest

from solver.capture.capture import Markers, TrialFiles
from solver.capture.formats.storage import write_storage
from solver.capture.formats.trc import write_trc
from solver.capture.reading_settings import READING, ReadingSettings
from solver.capture.trial import read_static, read_trial
from solver.common.errors import CaptureError
from solver.fitting.settings import Settings, read_settings

NAMES = ("C7", "CLAV", "LASI", "RASI", "LHEE", "RHEE", "LTOE", "RTOE")
HEIGHTS = np.array([1.5, 1.4, 1.0, 1.0, 0.05, 0.05, 0.02, 0.02])
FRAMES = 100
RATE = 100.0


def standing():
    rng = np.random.default_rng(3)
    across = rng.uniform(-0.2, 0.2, (len(NAMES), 2))
    place = np.column_stack([across[:, 0], HEIGHTS, across[:, 1]])
    return Markers(NAMES, place + 0.002 * rng.standard_normal((FRAMES, len(NAMES), 3)), RATE)


def changed(table, **values):
    return replace(READING, **{table: replace(getattr(READING, table), **values)})


@pytest.fixture
def stood(tmp_path):
    """Somebody stands on one plate, whose columns hold the free moment; C7 leaps once, by 30 cm."""
    markers = standing()
    positions = markers.positions_ground.copy()
    positions[40, 0, 0] += 0.3
    write_trc(tmp_path / "m.trc", replace(markers, positions_ground=positions))
    times = np.arange(FRAMES) / RATE
    load = 700.0 + 20.0 * np.sin(7 * times)
    still = np.zeros(FRAMES)
    labels = [f"ground_force_1_{kind}{axis}" for kind in "vp" for axis in "xyz"]
    labels += [f"ground_torque_1_{axis}" for axis in "xyz"]
    columns = [still, load, still, still + 0.05, still, still + 0.01, still, still + 1.0, still]
    write_storage(tmp_path / "f.mot", labels, times, np.stack(columns, axis=1))
    return TrialFiles("stood", tmp_path / "m.trc", tmp_path / "f.mot")


def notes(files, settings):
    return " ".join(read_trial(files, settings).notes)


def test_the_settings_file_reaches_the_reading(tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text("[cleaning]\nspike_m = 0.2\n[platforms]\nlongest_side_m = 9\n", encoding="utf-8")
    reading = read_settings(path).reading
    assert reading.cleaning.spike_m == 0.2
    assert reading.platforms.longest_side_m == 9.0
    assert reading.axes == READING.axes
    assert Settings().reading == READING


def test_every_part_of_reading_is_a_table():
    assert {part.name for part in fields(ReadingSettings)} <= {stage.name for stage in fields(Settings)}


@pytest.mark.parametrize(
    ("table", "values", "said"),
    [
        ("length_units", {"largest_m": 1.0}, "would span"),
        ("axes", {"margin": 100.0}, "ambiguous"),
        ("force_tables", {"longest_lab_m": 0.01}, "read as mm"),
        ("pairing", {"near_m": 0.001}, "from the nearest marker"),
    ],
)
def test_a_table_decides_how_a_trial_is_read(stood, table, values, said):
    assert said not in notes(stood, READING)
    assert said in notes(stood, changed(table, **values))


def test_spikes_are_what_the_settings_say(stood):
    assert np.isnan(read_trial(stood).markers.positions_ground[40, 0]).all()
    lenient = read_trial(stood, changed("cleaning", spike_m=0.5))
    assert np.isfinite(lenient.markers.positions_ground).all()
    near = changed("cleaning", farthest_m=1.45)
    assert "C7" not in read_static(stood.markers, near).markers.names


def test_a_clock_may_miss_as_many_rows_as_the_settings_say(stood):
    lines = stood.markers.read_text(encoding="utf-8").splitlines()
    kept = [line for i, line in enumerate(lines) if not 30 <= i < 60]
    stood.markers.write_text("\n".join(kept) + "\n", encoding="utf-8")
    assert "30 rows are missing" in notes(stood, READING)
    with pytest.raises(CaptureError, match="two recordings in one file"):
        read_trial(stood, changed("clock", gap_limit=0.1))


def test_platforms_of_a_c3d_file_are_checked_as_the_settings_say(tmp_path, write_c3d, plate_of):
    n = 60
    load = np.full(n, -700.0)  # z of the plate points down
    lever = np.full(n, 10.0)
    nought = np.zeros(n)
    plate = plate_of(
        2, np.stack([nought, nought, load, lever, nought, nought], axis=1), units=("N",) * 3 + ("Nm",) * 3
    )
    points = standing().positions_ground[:n][:, :, [0, 2, 1]] * 1000
    files = TrialFiles("c", write_c3d(tmp_path / "a.c3d", points, NAMES, plates=[plate]))
    assert len(read_trial(files).plates) == 1
    assert not read_trial(files, changed("platforms", longest_side_m=0.3)).plates
    hidden = read_trial(files, changed("platforms", centre_known_N=900.0)).plates[0]
    assert np.isnan(hidden.cop_ground).all()
    assert "lie on the plate" in notes(files, changed("platform_units", inside_margin=0.0))
