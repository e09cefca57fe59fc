from pathlib import Path

import pytest

from addb_viewer.dataset.identifiers import file_name_of, labels_without_names, side_of, without_names


@pytest.mark.parametrize(
    ("body", "side"),
    [
        ("calcn_r", "r"),
        ("calcn_l", "l"),
        ("RightFoot", "r"),
        ("footL", "l"),
        ("foot_left", "l"),
        ("Left_foot", "l"),
        ("foot", None),
        ("hand_r", "r"),
    ],
)
def test_the_side_of_a_foot_is_told_by_its_name(body, side):
    assert side_of(body) == side


def test_file_names_of_identifiers():
    assert file_name_of("Lab 1/P01") == "Lab 1__P01"
    assert file_name_of("Lab:1/Zoë?") == "Lab%3A1__Zo%C3%AB%3F"


def test_labels_lose_the_persons_name_and_none_comes_twice():
    labels = ["Smith:LASI", "Smith:RASI", "LASI", "C7", "Smith:"]
    assert labels_without_names(labels) == ["LASI", "RASI", "LASI_2", "C7", "Smith:"]


@pytest.mark.parametrize(
    ("note", "told"),
    [
        ("/home/anna/data/P1/walk.trc: 3 gaps", "walk.trc: 3 gaps"),
        ("walk: markers of 2023-04-05 12:30:01 left out", "walk: markers of [date] left out"),
        ("session 20230405 and 5.4.2023", "session [date] and [date]"),
        ("Smith:LASI is up to 3 cm off", "[name]:LASI is up to 3 cm off"),
        ("frames 1999-2003 and 120 N", "frames 1999-2003 and 120 N"),
        ("Smithson stays, force/moment too", "Smithson stays, force/moment too"),
        (r"C:\data\anna\walk.trc: read", "walk.trc: read"),
    ],
)
def test_notes_lose_paths_dates_and_names(note, told):
    assert without_names(note, Path("/home/anna/data/P1"), ["Smith"]) == told
