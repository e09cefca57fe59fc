"""What is told of two versions' answers, and what is not."""

import json

import pandas as pd

from benchmarks.same_answers import compare


def _answers(out, fit, column, table="trial.csv"):
    results = out / "recordings" / "walk" / "results"
    (results / "csv").mkdir(parents=True)
    (results / "fit.json").write_text(json.dumps(fit))
    pd.DataFrame({"knee": column}).to_csv(results / "csv" / table, index=False)
    return out


def test_numbers_that_differ_and_names_that_moved_are_told_and_nothing_else(tmp_path):
    before = _answers(
        tmp_path / "before",
        {
            "sha256": "a" * 64,
            "notes": ["a sentence"],
            "mass_kg": 70.0,
            "old": 1.0,
            "trials": [{"name": "b", "rms": 1.0}, {"name": "a", "rms": 2.0, "mask": "none"}],
        },
        [0.0, 1e-4, 10.0],
    )
    after = _answers(
        tmp_path / "after",
        {
            "sha256": "b" * 64,
            "notes": ["another sentence"],
            "mass_kg": 70.05,
            "new": 1.0,
            "trials": [{"name": "a", "rms": 2.1, "mask": "people"}, {"name": "b", "rms": 1.0}],
        },
        [1e-4, 0.0, 10.0],
    )

    assert compare(before, after, 0.001) == [
        "fit.json: new: new, 1 times",
        "fit.json: old: gone, 1 times",
        "recordings/walk/results/fit.json: trials[a].mask: none → people",
        "recordings/walk/results/fit.json: trials[a].rms: 2.0 → 2.1",
    ]


def test_rows_of_a_table_and_whole_files_are_told(tmp_path):
    before = _answers(tmp_path / "before", {}, [0.0, 1.0, 10.0])
    after = _answers(tmp_path / "after", {}, [0.0, None, 10.5])
    other = _answers(tmp_path / "other", {}, [0.0], table="run.csv")

    assert compare(before, before, 0.0) == []
    assert compare(before, after, 0.001) == [
        "recordings/walk/results/csv/trial.csv: knee: 2 of 3 rows differ, by up to 0.5 of 10.5"
    ]
    assert compare(before, other, 0.001) == [
        "recordings/walk/results/csv/run.csv: new, 1 times",
        "recordings/walk/results/csv/trial.csv: gone, 1 times",
    ]
