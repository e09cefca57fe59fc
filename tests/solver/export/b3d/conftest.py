"""A small .b3d subject made by hand, and what two of them have in common."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from solver.export.b3d.schema import (
    B3dFile,
    B3dTrial,
    Header,
    PassFrames,
    PassHeader,
    PassModel,
    SensorFrames,
    TrialHeader,
)

LENGTHS = (3, 5)


def assert_same(one, other, place="file"):
    """Equal in every field; NaN equals NaN."""
    if is_dataclass(one):
        assert type(one) is type(other)
        for f in fields(one):
            assert_same(getattr(one, f.name), getattr(other, f.name), f"{place}.{f.name}")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, place
        np.testing.assert_array_equal(one, other, err_msg=place)
    elif isinstance(one, dict):
        assert one.keys() == other.keys(), place
        for key in one:
            assert_same(one[key], other[key], f"{place}[{key}]")
    elif isinstance(one, str | bytes) or not hasattr(one, "__len__"):
        assert one == other, place
    else:
        assert len(one) == len(other), place
        for i, (left, right) in enumerate(zip(one, other, strict=True)):
            assert_same(left, right, f"{place}[{i}]")


@pytest.fixture
def same():
    return assert_same


def _trial(name, frames, rng):
    about = PassHeader(
        dof_positions_observed=np.array([True, False]),
        marker_rms=rng.random(frames).astype(np.float32),
        lowpass_filter_order=3,
    )
    return B3dTrial(
        header=TrialHeader(
            name=name,
            missing_GRF_reason=np.array([0, 10, 18, 0, 5], np.int32)[:frames],
            trial_length=frames,
            trial_timestep=0.01,
            processing_pass_header=(about,),
            trial_tag=("übung",),
            num_force_plates=1,
            force_plate_corners=np.arange(12.0),
        ),
        sensors=SensorFrames(
            marker_obs=np.where(rng.random((frames, 3)) < 0.3, np.nan, rng.normal(size=(frames, 3))),
            raw_force_plate_force=np.zeros((frames, 3)),
        ),
        passes=(PassFrames(pos=rng.normal(size=(frames, 2)), tau=rng.normal(size=(frames, 2))),),
    )


@pytest.fixture
def subject() -> B3dFile:
    rng = np.random.default_rng(4)
    trials = tuple(_trial(f"trial {i}", frames, rng) for i, frames in enumerate(LENGTHS))
    header = Header(
        num_dofs=2,
        passes=(PassModel(0, "<OpenSimDocument/>"),),
        ground_contact_body=("calcn_r",),
        trial_header=tuple(trial.header for trial in trials),
        version=4,
        biological_sex="female",
        height_m=1.65,
        marker_name=("C7",),
        subject_tag=("healthy", ""),
    )
    return B3dFile(header, trials)
