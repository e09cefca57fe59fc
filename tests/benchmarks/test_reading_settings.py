"""Recordings that are changed beforehand: made-up ones get the answers that they were made for."""

import numpy as np

from benchmarks.reading_settings.axes import WAYS_UP, Turned
from benchmarks.reading_settings.people import NOT_TOLD, ONE, TALLER, TWO, Couple, Seen
from benchmarks.reading_settings.zeros import Beginning
from benchmarks.varied import Answer, Questions
from solver.capture.axes import AxesSettings
from solver.capture.body_lengths import BodyLengthSettings
from solver.capture.capture import ForcePlate, Markers
from solver.capture.edge_zeros import EdgeZeroSettings


class Odd:
    """Asked whether a number is odd, by settings that say how many to add."""

    def __init__(self, number):
        self.number, self.truth = number, (number % 2 == 1, True)
        self.person = "small" if number < 2 else "large"

    def answers(self, settings):
        return ((self.number + settings) % 2 == 1, settings == 0)


def test_questions_count_what_is_wrong_and_what_changes():
    questions = Questions(0, lambda: map(Odd, range(4)))
    nobody = {"small": 0.0, "large": 0.0}
    assert questions.answer(("Some", 1.0, 0)) == Answer("Some", 1.0, 0.0, 0.0, 8, nobody)
    assert questions.answer(("Some.one", 2.0, 1)) == Answer(
        "Some.one", 2.0, 1.0, 1.0, 8, {"small": 0.5, "large": 0.5}
    )


def test_what_is_wrong_is_told_by_person():
    questions = Questions(0, lambda: map(Odd, range(3)))
    told = questions.answer(("Some.two", 2.0, 2))
    assert told.by_person == {"small": 2 / 6, "large": 1 / 6}
    assert (told.wrong, told.of) == (0.5, 6)


def test_a_body_in_other_axes_is_asked_for_the_axis_that_points_up():
    rng = np.random.default_rng(0)
    body = rng.uniform([-0.2, 0.0, -0.2], [0.2, 1.8, 0.2], size=(50, 12, 3))
    for up in WAYS_UP:
        markers = Markers(tuple(f"M{k}" for k in range(12)), body @ up.R_ground_lab, 100.0)
        plates = (np.tile([0.0, 700.0, 0.0], (50, 1)) @ up.R_ground_lab,)
        case = Turned("p", up, markers, plates, ())
        assert case.answers(AxesSettings())[0][0] == case.truth[0][0]


def test_zeros_before_a_load_are_counted():
    force = np.tile([0.0, 700.0, 0.0], (100, 1))
    force[:7] = 0.0
    plate = ForcePlate("p", force, np.zeros((100, 3)), np.zeros((100, 3)), 100.0)
    assert Beginning("p", plate, (7,)).answers(EdgeZeroSettings()) == (7,)
    landing = np.linspace([0.0, -300.0, 0.0], [0.0, 700.0, 0.0], 100).clip(0.0)
    plate = ForcePlate("p", landing, np.zeros((100, 3)), np.zeros((100, 3)), 100.0)
    assert Beginning("p", plate, (0,)).answers(EdgeZeroSettings()) == (0,)


def test_somebody_taller_is_another_person_and_few_lengths_tell_of_nobody():
    rng = np.random.default_rng(0)
    body = rng.uniform([-0.2, 0.0, -0.2], [0.2, 1.8, 0.2], size=(12, 3)) + rng.normal(0.0, 0.001, (50, 12, 3))

    def seen(positions, count=12):
        return Seen("p", Markers(tuple(f"M{k}" for k in range(count)), positions[:, :count], 100.0))

    same, taller = Couple(seen(body), seen(body), ONE), Couple(seen(body), seen(TALLER * body), TWO)
    assert [case.answers(BodyLengthSettings()) for case in (same, taller)] == [same.truth, taller.truth]
    mistaken = Couple(seen(body), seen(TALLER * body), ONE)
    assert mistaken.answers(BodyLengthSettings()) == (TWO, True)
    two_markers = Couple(seen(body, 2), seen(body, 2), ONE)
    assert two_markers.answers(BodyLengthSettings()) == (NOT_TOLD, False)
