import json
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from solver.common.errors import ResultsError
from solver.dynamics.trajectory.extension import BodyWrench, Cause, Extension, TrialExtension
from solver.fitting.results.extension_log import (
    FILE,
    accept,
    accepted,
    decisions,
    reject,
    reject_beside,
    standings,
)

CAUSES = (Cause("clock_offset", "all", {"offset_s": (0.01, 0.001)}), Cause("carried_mass", "torso", {}))
MADE_FROM = {"sha256 trials/walk/markers.trc": "abc", "mass_kg": "70.0"}


@pytest.fixture
def extension() -> Extension:
    rng = np.random.default_rng(0)
    parts = tuple(
        BodyWrench(body, rng.normal(size=(5, 6)), rng.normal(size=(5, 6, 3))) for body in ("torso", None)
    )
    known, evidence = np.array([1, 1, 1, 1, 0], dtype=bool), np.array([0, 1, 1, 1, 1], dtype=bool)
    walk = TrialExtension(parts, known, evidence)
    return Extension(CAUSES, np.array([1.0, 2.0, np.pi]), np.array([0.1, -0.2, 0.3]), {"walk/1": walk})


def test_nothing_is_accepted_before_anybody_decides(tmp_path):
    assert accepted(tmp_path) is None
    assert decisions(tmp_path / "absent") == ()


def test_an_extension_comes_back_as_it_was(tmp_path, extension):
    made = accept(
        tmp_path / "results", extension, by="Zoë", made_from=MADE_FROM, left_out=("marker_slip LTOE",)
    )
    decision, back = accepted(tmp_path / "results")
    assert (decision.by, decision.left_out, decision.made_from) == ("Zoë", ("marker_slip LTOE",), MADE_FROM)
    assert abs(decision.when - datetime.now(UTC)) < timedelta(minutes=1)
    assert decision.causes == CAUSES == back.causes
    assert made.wrenches == decision.wrenches
    assert back.fingerprint == extension.fingerprint
    (one,), (other,) = extension.trials.values(), back.trials.values()
    assert [p.body for p in other.parts] == ["torso", None]
    np.testing.assert_array_equal(one.columns_ground, other.columns_ground)
    np.testing.assert_array_equal(one.evidence, other.evidence)


def test_the_last_decision_holds_and_none_is_lost(tmp_path, extension):
    accept(tmp_path, extension, by="Anna", made_from=MADE_FROM)
    reject(tmp_path, CAUSES, by="Bo", made_from=MADE_FROM)
    assert accepted(tmp_path) is None
    other = Extension(CAUSES[:1], np.ones(1), np.ones(1))
    accept(tmp_path, other, by="Anna", made_from=MADE_FROM)
    assert accepted(tmp_path)[1].fingerprint == other.fingerprint
    assert [(d.kind, d.by) for d in decisions(tmp_path)] == [
        ("accept", "Anna"),
        ("reject", "Bo"),
        ("accept", "Anna"),
    ]


def test_a_line_that_a_killed_run_left_unfinished_was_never_decided(tmp_path, extension):
    accept(tmp_path, extension, by="Anna", made_from=MADE_FROM)
    reject(tmp_path, CAUSES, by="Bo", made_from=MADE_FROM)
    whole = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(whole[:-7])
    assert accepted(tmp_path)[0].by == "Anna"
    reject(tmp_path, CAUSES, by="Cy", made_from=MADE_FROM)
    assert [d.by for d in decisions(tmp_path)] == ["Anna", "Cy"]


@pytest.mark.parametrize("line", ["not json", '{"decision": "maybe"}', "[]"])
def test_a_spoilt_log_says_where(tmp_path, line):
    (tmp_path / FILE).write_text(f"{line}\n")
    with pytest.raises(ResultsError, match="line 1"):
        decisions(tmp_path)


def test_missing_wrenches_are_named(tmp_path, extension):
    made = accept(tmp_path, extension, by="Anna", made_from=MADE_FROM)
    (tmp_path / made.wrenches).unlink()
    with pytest.raises(ResultsError, match=made.wrenches):
        accepted(tmp_path)


def test_fingerprints_tell_extensions_apart(extension):
    other = Extension(extension.causes, extension.prior_std, extension.x + 1e-9, extension.trials)
    assert other.fingerprint != extension.fingerprint


def test_a_rejection_beside_what_is_accepted_changes_no_later_solve(tmp_path, extension):
    clock, load = ((cause.id, cause.target) for cause in CAUSES)
    first = Extension(CAUSES[:1], np.ones(1), np.ones(1))
    accept(tmp_path, first, by="Anna", made_from=MADE_FROM)
    reject_beside(tmp_path, CAUSES[1:], by="Bo")
    decision, held = accepted(tmp_path)
    assert held.fingerprint == first.fingerprint
    assert (decision.causes, decision.rejected, decision.made_from) == (CAUSES[:1], CAUSES[1:], MADE_FROM)
    told = standings(decisions(tmp_path))
    assert {key: (s.kind, s.by) for key, s in told.items()} == {
        clock: ("accept", "Anna"),
        load: ("reject", "Bo"),
    }
    reject(tmp_path, CAUSES, by="Cy", made_from=MADE_FROM)
    told = standings(decisions(tmp_path))
    assert {key: s.by for key, s in told.items()} == {clock: "Cy", load: "Bo"}  # Bo's word was so before


def test_a_log_of_before_single_causes_were_decided_is_read(tmp_path, extension):
    accept(tmp_path, extension, by="Anna", made_from=MADE_FROM)
    line = json.loads((tmp_path / FILE).read_text())
    del line["rejected"]
    (tmp_path / FILE).write_text(json.dumps(line) + "\n")
    (decision,) = decisions(tmp_path)
    assert decision.rejected == ()
    assert decision.standing == {(cause.id, cause.target): "accept" for cause in CAUSES}
