"""The hider's D: what of a true fault another one cannot take over, from how it was edited."""

import json

import numpy as np
import pytest

from benchmarks.faults.distance import distance_nats, undecidable
from benchmarks.faults.editor.clocks import drifting
from benchmarks.faults.editor.files import write_folder
from benchmarks.faults.editor.sources import SOURCES
from solver.capture.subject.subject import open_subject
from solver.common.progress import silent
from solver.diagnosis.causes.clocks import ClockOffset, SampleRate
from solver.diagnosis.diagnose import repaired_balance
from solver.fitting.settings import settings_for

STRETCH = -0.015


@pytest.fixture(scope="module")
def draw(real_data, tmp_path_factory):
    """One case of a draw: a clock that runs off for 1.2 s."""
    out = tmp_path_factory.mktemp("draw")
    recording = next(s for s in SOURCES if s.name == "treadmill walk I").read(real_data)
    edited, _ = drifting(STRETCH)(recording, np.random.default_rng(0))
    write_folder(out / "subjects" / "case_000", edited)
    return out


@pytest.fixture(scope="module")
def balance(draw):
    folder = draw / "subjects" / "case_000"
    return repaired_balance(
        open_subject(folder), settings_for(folder), trials=None, reviews={}, progress=silent
    )[0]


def test_of_a_second_a_lag_says_nearly_what_a_rate_does(balance):
    rate, clock = SampleRate("all"), ClockOffset("all")
    assert distance_nats(balance, rate, (STRETCH,), rate) == pytest.approx(0.0, abs=0.01)
    small, large = (distance_nats(balance, rate, (stretch,), clock) for stretch in (STRETCH, 3 * STRETCH))
    assert 0.0 < small < 5.0 < large
    null = balance.solve([]).noise_scale
    fixed = balance.term(rate, (STRETCH,)).fixed
    alone = 0.5 * float(fixed @ np.linalg.solve(null.covariance, fixed))
    assert small < 0.5 * alone


def named(target="all", others=("sample_rate",), told_as="name"):
    alternatives = [{"id": id, "target": "all", "instead_of": f"clock_offset {target}"} for id in others]
    effects = [{"id": "clock_offset", "target": target, "told_as": told_as}]
    return {"effects": effects, "alternatives": alternatives}


def test_a_class_is_right_only_where_it_holds_the_truth_and_more_could_not_be_told(draw):
    truth = {"case": "case_000", "kind": "drift", "size": {"stretch": STRETCH}}
    assert undecidable(draw, truth, named())
    assert not undecidable(draw, truth, named(others=("plate_yaw",)))
    assert not undecidable(draw, truth, named(others=("sample_rate", "drag", "plate_yaw")))
    assert not undecidable(draw, truth, named(told_as="tentative"))
    assert not undecidable(draw, truth | {"kind": "half_gain"}, named())
    (draw / "distances" / "case_000.json").write_text(json.dumps({"nats": 6.0}))
    assert not undecidable(draw, truth, named())
