"""Faults edited into a real recording's force file: what has no name here is told as what it touches."""

import shutil

import numpy as np
import pytest

from solver.diagnosis.diagnose_subject import diagnose_subject

FOLDER = "walk_rajagopal2015"


def edited(source, folder, change):
    """A copy whose force table a function changed: labels and numbers of the file, nothing of the solver."""
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("results"))
    path = folder / "grf.mot"
    lines = path.read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.split()[:1] == ["time"])
    labels = lines[first].split()
    rows = np.array([[float(x) for x in line.split()] for line in lines[first + 1 :] if line.strip()])
    rows = change(labels, rows)
    text = ["\t".join(f"{x:.6f}" for x in row) for row in rows]
    path.write_text("\n".join([*lines[: first + 1], *text]) + "\n")
    return folder


def turned_by_a_quarter(labels, rows):
    """The first plate's axes are exchanged: x reads what is along z."""
    stem = next(label for label in labels if label.endswith("_vx"))[: -len("_vx")]
    force = [labels.index(f"{stem}_v{axis}") for axis in "xz"]
    place = [labels.index(f"{stem}_p{axis}") for axis in "xz"]
    on = rows[:, labels.index(f"{stem}_vy")] > 20
    middle = rows[on][:, place].mean(axis=0)
    turned = rows.copy()
    turned[:, force] = rows[:, force[::-1]] * (1, -1)
    turned[:, place] = middle + (rows[:, place] - middle)[:, ::-1] * (1, -1)
    return turned


def cross_thread(labels, rows):
    """The first plate's forward channel reads a quarter of the load as well; pressures stay."""
    stem = next(label for label in labels if label.endswith("_vx"))[: -len("_vx")]
    leaked = rows.copy()
    leaked[:, labels.index(f"{stem}_vx")] += 0.25 * rows[:, labels.index(f"{stem}_vy")]
    return leaked


def late_by_20_ms(labels, rows):
    times = rows[:, 0]
    return np.column_stack([times, *(np.interp(times - 0.02, times, column) for column in rows[:, 1:].T)])


@pytest.fixture
def source(real_data):
    if not (real_data / FOLDER).is_dir():
        pytest.skip(f"{FOLDER} not among the recordings")
    return real_data / FOLDER


@pytest.mark.real
def test_what_has_no_name_is_told_as_that_plate_and_given_no_wrong_name(source, tmp_path):
    told = diagnose_subject(edited(source, tmp_path / "leaking", cross_thread))
    assert told["verdict"] == "unexplained"
    off = told["remaining"]["off_the_list"]
    assert (off["touches"], off["target"]) == ("plate", "plate_1")
    assert off["gain_nats"] > 20
    assert not [e["id"] for e in told["effects"] if e["confidence"] > 0.5]


@pytest.mark.real
def test_a_turned_plate_is_named(source, tmp_path):
    told = diagnose_subject(edited(source, tmp_path / "turned", turned_by_a_quarter))
    (effect,) = told["effects"]
    assert (effect["id"], effect["target"]) == ("plate_turn", "plate_1")
    assert abs(effect["parameters"]["turn_deg"]["value"]) == 90.0
    assert effect["confidence"] > 0.9


@pytest.mark.real
def test_a_late_clock_keeps_its_name(source, tmp_path):
    told = diagnose_subject(edited(source, tmp_path / "late", late_by_20_ms))
    (effect,) = told["effects"]
    assert effect["id"] == "clock_offset"
    assert effect["parameters"]["offset_s"]["value"] == pytest.approx(0.02, abs=0.006)
    # in 2.4 s a late clock and one of another rate are nearly the same; nothing else has a share
    rates = sum(rival["confidence"] for rival in told["alternatives"] if rival["id"] == "sample_rate")
    assert effect["confidence"] > 2 * rates
    assert effect["confidence"] + rates > 0.95
    assert effect["outside_the_list"] < 0.2
    assert told["remaining"]["off_the_list"] is None
