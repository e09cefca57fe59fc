"""What direct checks say, as lines of the page."""

from addb_viewer.text.direct_check_words import ABOUT, what_the_files_say
from solver.diagnosis.direct_checks.statement import About
from tests.addb_viewer.told_diagnosis import told


def direct_check(nats, speaks_for, trial="walk1", sentence="The forces come 40 ms after the markers."):
    return {
        "direct_check": "lag",
        "trial": trial,
        "target": None,
        "sentence": sentence,
        "speaks_for": speaks_for,
        "nats": nats,
        "figures": {},
        "against": [],
    }


def figures(*direct_checks, trials=("walk1",)):
    return told({"direct_checks": list(direct_checks), "trials": list(trials)})


def test_every_class_that_a_direct_check_can_speak_for_has_words():
    assert set(ABOUT) == {str(about) for about in About}


def test_quiet_direct_checks_are_one_line():
    section = what_the_files_say(
        figures(direct_check({"clock": -1.0}, []), direct_check({"filter": 0.3}, []))
    )
    assert section.lines == ("2 checks of forces and markers that need no body model: none shows a fault.",)
    assert not section.rows


def test_those_that_speak_are_told_the_clearest_first_with_their_trial_where_there_are_several():
    section = what_the_files_say(
        figures(
            direct_check({"clock": 6.0}, ["clock"], sentence="First."),
            direct_check(
                {"plate_sign": 30.0, "plate_zero": 7.0}, ["plate_sign", "plate_zero"], sentence="Second."
            ),
            trials=("walk1", "walk2"),
        )
    )
    assert "2 show a fault" in section.lines[0]
    assert [text for _, text in section.rows] == [
        "walk1: Second. Points clearly to a plate's sign, or a plate's zero level.",
        "walk1: First. Points to the clocks of forces and markers.",
    ]


def test_without_direct_checks_there_is_no_such_section():
    assert what_the_files_say(figures()).lines == ()
