"""Splits by person: nobody moves, nobody is in two, and the shares hold in every source."""

import json
import math
from collections import Counter
from hashlib import sha256
from itertools import groupby

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.splits import (
    Person,
    by_shares,
    fraction,
    hold_out,
    k_fold,
    leave_one_person_out,
    persons_of,
)

SHARES = {"train": 0.9, "dev": 0.05, "test": 0.05}


def crowd(sizes):
    """So many persons in each source, of three activities by turns."""
    return [
        Person(f"source{s}/p{k}", f"source{s}", ("walk", "run", "squat")[k % 3])
        for s, size in enumerate(sizes)
        for k in range(size)
    ]


sizes = st.lists(st.integers(1, 70), min_size=1, max_size=8)


@given(sizes, st.integers(0, 5))
@settings(max_examples=40, deadline=None)
def test_shares_hold_within_one_person_of_the_quotas_rounding_in_each_source(sizes, seed):
    persons = crowd(sizes)
    split = by_shares(persons, seed)
    assert set(split) == {p.person_id for p in persons}
    for _, group in groupby(persons, key=lambda p: p.source):
        of_source = list(group)
        counted = Counter(split[p.person_id] for p in of_source)
        for name, share in SHARES.items():
            quota = share * len(of_source)
            assert math.floor(quota) - 1 <= counted[name] <= math.ceil(quota) + 1


@given(sizes, st.integers(0, 5))
@settings(max_examples=40, deadline=None)
def test_of_twenty_neighbours_in_the_order_one_goes_to_test_and_to_dev(sizes, seed):
    persons = crowd(sizes)
    order = sorted(
        persons, key=lambda p: (p.source, p.activity, sha256(f"{seed}/{p.person_id}".encode()).hexdigest())
    )
    split = by_shares(persons, seed)
    for first in range(0, len(order) - 19, 20):
        counted = Counter(split[p.person_id] for p in order[first : first + 20])
        assert counted == {"train": 18, "dev": 1, "test": 1}


@given(sizes, st.integers(0, 30), st.randoms(use_true_random=False))
@settings(max_examples=40, deadline=None)
def test_adding_persons_moves_none_and_the_shares_hold_over_all(sizes, more, random):
    persons = crowd(sizes)
    before = by_shares(persons)
    added = [Person(f"{random.choice('abc')}/new{k}", "new", "walk") for k in range(more)]
    after = by_shares([*persons, *added], previous=before)
    assert {person: after[person] for person in before} == before
    counted = Counter(after.values())
    for name, share in SHARES.items():
        assert abs(counted[name] - share * len(after)) < 1


def test_the_order_of_the_rows_changes_nothing():
    persons = crowd([13, 40])
    assert by_shares(persons) == by_shares(persons[::-1])


def test_another_seed_is_another_split():
    persons = crowd([60])
    assert by_shares(persons, 0) != by_shares(persons, 1)


def test_the_hash_is_sha256_of_seed_and_person():
    assert float(fraction(7, "a/b")) == pytest.approx(
        int(sha256(b"7/a/b").hexdigest()[:12], 16) / 16**12, abs=1e-12
    )


@given(sizes, st.integers(2, 7))
@settings(max_examples=30, deadline=None)
def test_folds_are_equal_to_within_one_person(sizes, folds):
    persons = crowd([*sizes, 7])
    counted = Counter(k_fold(persons, folds).values())
    assert len(counted) == folds
    assert max(counted.values()) - min(counted.values()) <= 1


def test_more_folds_than_persons_are_refused():
    with pytest.raises(ReleaseError, match="5 folds of 3 persons"):
        k_fold(crowd([3]), 5)


def test_everybody_is_left_out_once():
    split = leave_one_person_out(crowd([4]))
    assert sorted(split.values()) == sorted(split)


def test_a_held_out_source_is_all_test_and_the_others_never_are():
    persons = crowd([19, 38])
    split = hold_out(persons, ["source0"])
    assert {split[p.person_id] for p in persons if p.source == "source0"} == {"test"}
    rest = Counter(split[p.person_id] for p in persons if p.source == "source1")
    assert rest == {"train": 36, "dev": 2}
    with pytest.raises(ReleaseError, match="no source 'nowhere'; the release has source0, source1"):
        hold_out(persons, ["nowhere"])


def test_an_earlier_split_of_another_kind_is_refused():
    persons = crowd([10])
    with pytest.raises(ReleaseError, match="knows 'fold-1'"):
        by_shares(persons, previous=k_fold(persons, 2))


SUBJECTS = pa.table(
    {
        "subject_id": ["lab/a1", "lab/a2", "lab/b"],
        "person_id": ["lab/a", "lab/a", "lab/b"],
        "source": ["lab", "lab", "lab"],
        "sex": ["female", "female", None],
        "age_years": [34.0, 34.0, None],
    }
)
TRIALS = pa.table(
    {
        "subject_id": ["lab/a1", "lab/a1", "lab/a2"],
        "activity": ["walk", "run", "run"],
        "duration_s": [3.0, 2.0, 2.0],
    }
)


def test_a_person_of_several_subjects_is_one_with_the_activity_of_most_seconds():
    assert persons_of(SUBJECTS, TRIALS) == (
        Person("lab/a", "lab", "run", "female", "30-39"),
        Person("lab/b", "lab", "unknown", "unknown", "unknown"),
    )


def run(*words):
    return CliRunner().invoke(app, ["dataset", "split", *map(str, words)])


@pytest.fixture
def release(tmp_path):
    pq.write_table(SUBJECTS, tmp_path / "subjects.parquet")
    pq.write_table(TRIALS, tmp_path / "trials.parquet")
    return tmp_path


def test_the_command_writes_a_row_a_person_and_counts(release):
    result = run(release, "--kfold", 2, "--name", "folds")
    assert result.exit_code == 0, result.output
    table = pq.read_table(release / "splits" / "folds.parquet").to_pydict()
    assert table["person_id"] == ["lab/a", "lab/b"]
    assert sorted(table["split"]) == ["fold-1", "fold-2"]
    told = json.loads((release / "splits" / "folds.json").read_text())
    of_a = table["split"][0]
    assert told["persons"]["sex"]["female"] == {name: int(name == of_a) for name in ("fold-1", "fold-2")}
    assert sum(told["persons"]["all"]["all"].values()) == 2
    first = (release / "splits" / "folds.parquet").read_bytes()
    again = run(release, "--kfold", 2, "--name", "folds", "--previous", release / "splits" / "folds.parquet")
    assert again.exit_code == 0, again.output
    assert (release / "splits" / "folds.parquet").read_bytes() == first


def test_a_split_that_leaves_nobody_in_test_says_so(release):
    assert "note: nobody is in test: 2 persons are too few" in run(release).output
    assert "note:" not in run(release, "--kfold", 2, "--name", "folds").output


def test_two_kinds_at_once_are_refused(release):
    result = run(release, "--kfold", 2, "--leave-one-person-out")
    assert result.exit_code == 2
    assert "two kinds of split" in result.output
