"""The JSON against the contract of the diagnosis."""

import json
from dataclasses import replace

import pytest

from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.diagnosis import Gain, Location, Remaining
from solver.diagnosis.diagnosis_report import (
    DiagnosisReport,
    ForceOverTime,
    Rival,
    cause_of,
    report,
    told_check,
)
from solver.diagnosis.direct_checks.statement import About, Statement
from solver.diagnosis.residual_description import (
    AxisResidual,
    PhaseResidual,
    Residual,
    ResidualOverTime,
    TrialResidual,
    WorstResidual,
)

CLOCK, LATE = ABOUT["clock_offset"], {"offset_s": Estimate(0.0123, 0.0004)}


@pytest.fixture
def diagnosis() -> DiagnosisReport:
    return DiagnosisReport(
        verdict="explained",
        effects=(cause_of(CLOCK, "all", LATE, 0.98, [Range("walk1", 0, 412)]),),
        alternatives=(
            Rival("filter_mismatch", "all", "clock_offset all", "cosine 0.99", "a quiet standing trial"),
        ),
        gain={
            "held_out_linear_residual_N": Gain(41.0, 12.2, (11.0, 13.9)),
            "held_out_angular_residual_Nm": Gain(19.5, 8.1, (7.2, 9.0)),
            "marker_rms_m": Gain(0.0121, 0.0120),
        },
        remaining=Remaining(12.2, 9.8),
        trials=("walk1",),
    )


def plain(diagnosis: DiagnosisReport) -> dict:
    """Through strict JSON and back."""
    return json.loads(json.dumps(report(diagnosis).as_json(), allow_nan=False))


def test_a_search_that_ended_early_is_told(diagnosis):
    assert plain(diagnosis)["ended_early"] is False
    assert plain(replace(diagnosis, ended_early=True))["ended_early"] is True


def test_every_part_of_the_contract_is_there_as_it_is_written_there(diagnosis):
    told = plain(diagnosis)
    assert told["verdict"] == "explained"
    (effect,) = told["effects"]
    assert effect["id"] == "clock_offset"
    assert effect["target"] == "all"
    assert effect["at_fault"] == "recording"
    assert told["chances"] is None
    assert effect["parameters"] == {"offset_s": {"value": 0.0123, "std": 0.0004}}
    assert effect["confidence"] == 0.98
    assert effect["trial"] == "walk1"
    assert effect["frames"] == [["walk1", 0, 412]]
    (other,) = told["alternatives"]
    assert {"id", "target", "why", "separate_by"} <= set(other)
    assert told["gain"] == {
        "held_out_linear_residual_N": {"before": 41.0, "after": 12.2, "interval": [11.0, 13.9]},
        "held_out_angular_residual_Nm": {"before": 19.5, "after": 8.1, "interval": [7.2, 9.0]},
        "marker_rms_m": {"before": 0.0121, "after": 0.0120, "interval": None},
    }
    assert told["remaining"] == {
        "linear_residual_N": 12.2,
        "noise_floor_N": 9.8,
        "location": None,
        "off_the_list": None,
    }


def test_with_several_trials_frames_name_theirs(diagnosis):
    both = cause_of(CLOCK, "all", LATE, 0.98, [Range("walk1", 0, 412), Range("walk2", 3, 99)])
    told = plain(replace(diagnosis, effects=(both,), trials=("walk1", "walk2")))
    assert told["effects"][0]["frames"] == [["walk1", 0, 412], ["walk2", 3, 99]]
    assert told["effects"][0]["trial"] is None
    assert told["trials"] == ["walk1", "walk2"]


def test_of_several_trials_a_cause_in_one_names_it(diagnosis):
    told = plain(replace(diagnosis, trials=("walk1", "walk2")))
    assert told["effects"][0]["trial"] == "walk1"
    assert told["effects"][0]["frames"] == [["walk1", 0, 412]]


def test_what_the_recording_says_nothing_about_is_null(diagnosis):
    said_nothing = {"rest_length_m": Estimate(float("nan"), float("inf"))}
    unknown = cause_of(CLOCK, "all", said_nothing, 0.98, [Range("walk1", 0, 412)])
    told = plain(replace(diagnosis, effects=(unknown,)))
    assert told["effects"][0]["parameters"] == {"rest_length_m": {"value": None, "std": None}}


def test_a_place_is_told_with_its_force(diagnosis):
    location = Location("hand_l", 40.0, (38.0, -1.0, 7.0), "constant (92 % of it)")
    told = plain(replace(diagnosis, verdict="unexplained", remaining=Remaining(30.0, 9.8, location)))
    assert told["remaining"]["location"] == {
        "body": "hand_l",
        "rms_force_N": 40.0,
        "mean_force_N": [38.0, -1.0, 7.0],
        "depends_on": "constant (92 % of it)",
    }


def test_nothing_found_is_empty_lists_and_no_gain():
    told = plain(DiagnosisReport("clean", (), (), {}, Remaining(9.0, 9.8), ("walk1",)))
    assert (told["verdict"], told["effects"], told["alternatives"], told["gain"]) == ("clean", [], [], {})


def test_what_is_wrong_is_told_over_time_in_phases_and_along_axes(diagnosis):
    figures = {
        "seconds": 3.0, "force_N": 41.0, "force_floor_N": 10.0, "moment_Nm": 19.0, "moment_floor_Nm": 6.0,
    }  # fmt: skip
    worst = WorstResidual(**figures, frames=(40, 90))
    time_history = ResidualOverTime(*((k + 0.123456, float(k)) for k in range(7)))
    residual = Residual(
        **figures,
        phases=(PhaseResidual(**figures, phase="single_support", foot="calcn_r"),),
        axes=(
            AxisResidual(**figures, axis="x", direction="forward", mean_force_N=-3.0),
            AxisResidual(**figures, axis="z", direction=None, mean_force_N=1.0),
        ),
        trials=(TrialResidual(**figures, trial="walk1", worst=worst, time_history=time_history),),
    )
    told = plain(replace(diagnosis, residual=residual, rates_Hz={"walk1": 100.0}, starts_s={"walk1": 0.5}))
    assert (told["rates_Hz"], told["starts_s"]) == ({"walk1": 100.0}, {"walk1": 0.5})
    said = told["residual"]
    assert figures.items() <= said.items()
    assert said["phases"] == [{"phase": "single_support", "foot": "calcn_r", **figures}]
    assert [(a["axis"], a["direction"], a["mean_force_N"]) for a in said["axes"]] == [
        ("x", "forward", -3.0),
        ("z", None, 1.0),
    ]
    (trial,) = said["trials"]
    assert trial["worst"] == {"frames": [40, 90], **figures}
    assert trial["time_history"]["time_s"] == [0.12, 0.0]
    assert trial["time_history"]["moment_floor_Nm"] == [6.12, 6.0]


def test_a_force_for_a_while_is_told_over_time(diagnosis):
    (effect,) = diagnosis.effects
    time_history = ForceOverTime("walk1", 20, 2, ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)))
    told = plain(replace(diagnosis, effects=(replace(effect, time_histories=(time_history,)),)))
    assert told["effects"][0]["time_histories"] == [
        {"trial": "walk1", "start": 20, "step": 2, "force_N": [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]}
    ]


def test_every_statement_is_told_with_what_it_speaks_for(diagnosis):
    said = Statement(
        "lag",
        "The forces come 40 ms after the acceleration of the markers.",
        {About.CLOCK: 8.1234, About.FILTER: -1.0},
        {"lag_s": 0.04},
        trial="walk1",
    )
    assert plain(replace(diagnosis, direct_checks=(told_check(said),)))["direct_checks"] == [
        {
            "direct_check": "lag",
            "trial": "walk1",
            "target": None,
            "sentence": "The forces come 40 ms after the acceleration of the markers.",
            "speaks_for": ["clock"],
            "nats": {"clock": 8.12, "filter": -1.0},
            "figures": {"lag_s": 0.04},
            "against": [],
        }
    ]
