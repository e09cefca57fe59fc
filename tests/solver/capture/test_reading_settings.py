"""Each table of reading reaches the place where it decides: a changed value changes what is read."""

from dataclasses import fields, replace

import numpy as np
import pytest

from solver.capture.capture import Markers, TrialFiles
from solver.capture.formats.storage import write_storage
from solver.capture.formats.trc import write_trc
from solver.capture.trial import READING, ReadingSettings, read_trial
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


def test_the_settings_file_reaches_the_reading(tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text("[cleaning]\nspike_m = 0.2\n[conditioning]\nthreshold_N = 30\n", encoding="utf-8")
    reading = read_settings(path).reading
    assert reading.cleaning.spike_m == 0.2
    assert reading.conditioning.threshold_N == 30.0
    assert Settings().reading == READING


def test_every_part_of_reading_is_a_table():
    assert {part.name for part in fields(ReadingSettings)} <= {stage.name for stage in fields(Settings)}


def test_spikes_are_what_the_settings_say(stood):
    assert np.isnan(read_trial(stood).markers.positions_ground[40, 0]).all()
    lenient = read_trial(stood, changed("cleaning", spike_m=0.5))
    assert np.isfinite(lenient.markers.positions_ground).all()
