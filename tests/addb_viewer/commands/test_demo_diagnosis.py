"""What the demo hides is what the diagnosis names: the missed step and the late forces."""

import numpy as np
import pytest

from addb_viewer.commands.demo import SEED
from solver.diagnosis.diagnose import diagnose_subject
from solver.simulate.demo import LateForces, write_demo_subject


@pytest.fixture(scope="module")
def told_and_true(tmp_path_factory):
    """The diagnosis of the demo's walk, which is the same without the other trials, and the truth."""
    folder = tmp_path_factory.mktemp("demo") / "S1"
    rng = np.random.default_rng(SEED)
    truth = write_demo_subject(folder, rng, trials=("static", "walk"), cause=LateForces())
    return diagnose_subject(folder), truth


def test_both_causes_are_named_and_no_other(told_and_true):
    told, truth = told_and_true
    ((foot, _, _),) = truth.off_plate["walk"]
    assert {(e["id"], e["target"]) for e in told["effects"]} == {
        ("off_plate_step", foot),
        ("clock_offset", "all"),
    }
    assert told["verdict"] == "explained"
    assert told["alternatives"] == []


def test_the_delay_is_the_hidden_one(told_and_true):
    told, truth = told_and_true
    (late,) = (e for e in told["effects"] if e["id"] == "clock_offset")
    offset = late["parameters"]["offset_s"]
    assert offset["value"] == pytest.approx(truth.cause.offset_s, abs=max(2 * offset["std"], 0.001))
    assert offset["std"] < 0.001


def test_the_step_is_where_it_was(told_and_true):
    told, truth = told_and_true
    (step,) = (e for e in told["effects"] if e["id"] == "off_plate_step")
    ((_, since, until),) = truth.off_plate["walk"]
    ((start, end),) = step["frames"]
    assert start / 100 == pytest.approx(since, abs=0.05)
    assert (end - 1) / 100 == pytest.approx(until, abs=0.05)
