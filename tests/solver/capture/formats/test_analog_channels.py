"""Channels that belong to no force plate, against ezc3d's own numbers and names."""

import os

import ezc3d
import numpy as np
import pytest

from solver.capture.formats import analog_channels
from solver.capture.formats.analog_channels import AnalogChannels, channels_listed, read_analog
from solver.common.errors import CaptureError

WITH_EMG = (  # integers and reals, Intel and DEC, first frames other than 1, treadmills, units of all kinds
    "c3d_conformance/btk_others/ADemo1_rewrite_c3d_pc_integer.c3d",
    "c3d_conformance/c3dorg_sample02/DEC_INT.C3D",
    "c3d_conformance/c3dorg_sample02/Dec_real.c3d",
    "c3d_conformance/c3dorg_sample10/type-2a.c3d",
    "c3d_lab_trials/opensim_core/doubleLegLanding.c3d",
    "sprint_overground_dorn2012_JA1_9ms/JA1Gait35.c3d",
    "wild/child_HC031A/Straight/HC031A06.c3d",
    "wild/cortex_six_plates/Res16bits.c3d",
    "wild/run_qualisys_type3/Running_0002.c3d",
    "wild/treadmill_plates_twice_TD31/fws_end01.c3d",
    "wild/unipd_bts/2012_10_17/Walking1.c3d",
)


@pytest.mark.parametrize("name", WITH_EMG)
def test_samples_names_and_units_are_ezc3ds(real_data, name):
    raw = ezc3d.c3d(str(real_data / name))
    found = read_analog([real_data / name])
    parameters, frames = raw["parameters"], raw["data"]["points"].shape[2]
    platform = parameters["FORCE_PLATFORM"]
    used = int(platform["USED"]["value"][0])
    of_plates = set(np.array(platform["CHANNEL"]["value"])[..., :used].ravel().astype(int) - 1)
    expected = [k for k in range(raw["data"]["analogs"].shape[1]) if k not in of_plates]
    np.testing.assert_array_equal(found.values, raw["data"]["analogs"][0, expected].T)
    labels = [parameters["ANALOG"]["LABELS"]["value"][k].strip() for k in expected]
    for k, called, label in zip(expected, found.names, labels, strict=True):
        assert called.partition("#")[0] == (label or f"channel {k + 1}")
    assert len(set(found.names)) == len(labels)
    assert list(found.units) == [parameters["ANALOG"]["UNITS"]["value"][k].strip() for k in expected]
    per_frame = len(found.values) / frames
    assert found.times[round(per_frame) * 7] == pytest.approx(7 / parameters["POINT"]["RATE"]["value"][0])
    assert channels_listed([real_data / name]) == tuple(zip(found.names, found.units, strict=True))


@pytest.fixture
def many(tmp_path):
    """300 channels, of which some share a name and one has none, and no plate."""
    c3d = ezc3d.c3d()
    c3d["parameters"]["POINT"]["RATE"]["value"] = [100]
    c3d["parameters"]["POINT"]["LABELS"]["value"] = ["A"]
    c3d["data"]["points"] = np.ones((4, 1, 20))
    names = ["VL", "VL", "", *(f"s{k}" for k in range(3, 300))]
    analog = c3d["parameters"]["ANALOG"]
    analog["RATE"]["value"] = [1000]
    entries = {"LABELS": names, "DESCRIPTIONS": [""] * 300, "UNITS": ["mV"] * 300, "SCALE": [1.0] * 300}
    for name, values in (entries | {"OFFSET": [0] * 300}).items():
        analog[name]["value"] = values[:255]
        c3d.add_parameter("ANALOG", f"{name}2", values[255:])
    analog["OFFSET2"]["type"] = ezc3d.ezc3d.INT
    c3d["data"]["analogs"] = np.random.default_rng(0).normal(size=(1, 300, 200))
    c3d.write(str(tmp_path / "many.c3d"))
    return tmp_path / "many.c3d"


def test_repeats_are_numbered_as_markers_are_and_what_has_no_name_is_kept_by_its_number(many):
    found = read_analog([many])
    assert found.names[:4] == ("VL", "VL#2", "channel 3", "s3")
    assert (found.names[-1], found.units[-1]) == ("s299", "mV")
    assert found.units[:255] == ("",) * 255  # ezc3d does not write them
    np.testing.assert_array_equal(found.values, ezc3d.c3d(str(many))["data"]["analogs"][0].T)
    one = read_analog([many], ["VL#2", "s299"])
    np.testing.assert_array_equal(one.values, found.values[:, [1, 299]])


def test_a_list_of_channels_reads_no_sample(many, monkeypatch):
    monkeypatch.setattr(analog_channels, "open_c3d", None)
    os.truncate(many, 20 * 512)  # its parameters are left
    assert len(channels_listed([many])) == 300


def test_labels_of_a_table_are_unlike_and_end_with_the_unit(many):
    found = read_analog([many])
    assert found.labels[:3] == ("VL", "VL#2", "channel 3")
    assert found.labels[-1] == "s299_mV"
    named = AnalogChannels(("time", "VL_V", "VL"), ("s", "", "V"), np.zeros((2, 3)), 1000.0)
    assert list(named.columns) == ["time_s", "time_s#2", "VL_V", "VL_V#2"]
    assert len(set(found.columns)) == 301


def test_what_is_not_there_is_named(many, tmp_path):
    assert read_analog([tmp_path / "walk.trc"]) is None
    with pytest.raises(CaptureError, match=r"many\.c3d: has no analog channel soleus"):
        read_analog([many], ["soleus"])
    with pytest.raises(CaptureError, match=r"gone\.c3d: cannot be read"):
        read_analog([tmp_path / "gone.c3d"])
