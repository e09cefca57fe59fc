"""Which frame a film shows at which time."""

import pytest

from addb_viewer.app.shell.capturing import film_of


@pytest.mark.parametrize(
    ("rate", "speed", "every"),
    [(50.0, 1.0, 1), (60.0, 1.0, 1), (100.0, 1.0, 2), (100.0, 0.5, 1), (250.0, -2.0, 9)],
)
def test_a_film_has_every_nth_frame_for_exactly_its_time(rate, speed, every):
    film = film_of(10, 110, rate, speed)
    assert sorted(film.frames) == list(range(10, 110, every))
    assert film.rate * every == pytest.approx(rate * abs(speed))
    assert film.rate <= 60.0 < rate * abs(speed) / (every - 1 or 1e-9)
    assert (film.frames[0] == 10) == (speed > 0)
    assert film_of(7, 8, rate, speed).frames == (7,)
