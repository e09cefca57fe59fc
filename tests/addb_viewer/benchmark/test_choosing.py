"""What is chosen for a person is what does best on the others."""

from addb_viewer.benchmark.averages import by_person
from addb_viewer.benchmark.results import Result, Terms
from addb_viewer.benchmark.scoring import Score
from addb_viewer.benchmark.tables import chosen_by_others

TERMS = Terms("r", "1", "s", ("test",), "unfitted", "scored")


def result(name, **errors):
    """Errors by person and activity, as a_walk=1.0; `cop` is 100 times as much."""
    scores = []
    for key, error in errors.items():
        person, activity = key.split("_")
        for metric, factor in (("grf", 1), ("cop", 100)):
            scores.append(Score(person, person, f"{person}/{activity}", activity, metric, factor * error, 10))
    return Result(name, TERMS, tuple(scores), 1.0)


def test_nobodys_own_error_has_a_say():
    low = result("low", a_walk=9.0, b_walk=1.0, c_walk=1.0, a_run=5.0, b_run=5.0)
    high = result("high", a_walk=2.0, b_walk=3.0, c_walk=3.0, a_run=4.0, b_run=9.0)
    both = chosen_by_others([low, high], "best", "grf")
    # walk: for a others say low (1 against 3); for b and c high (low: 5, high: 2.5)
    assert by_person(both.scores, "grf", "walk") == {"a": 9.0, "b": 3.0, "c": 3.0}
    # run: for a, b says low (5 against 9); for b, a says high (5 against 4)
    assert by_person(both.scores, "grf", "run") == {"a": 5.0, "b": 9.0}
    assert by_person(both.scores, "cop", "walk") == {"a": 900.0, "b": 300.0, "c": 300.0}
    assert (both.name, both.seconds) == ("best", 2.0)


def test_where_nobody_else_does_it_all_activities_choose():
    low = result("low", a_walk=1.0, b_walk=1.0, b_jump=8.0)
    high = result("high", a_walk=2.0, b_walk=2.0, b_jump=7.0)
    both = chosen_by_others([low, high], "best", "grf")
    assert by_person(both.scores, "grf", "jump") == {"b": 8.0}
