"""Which frame a clip shows at which time, and that its file says so."""

import io

import numpy as np
import pytest
from PIL import Image

from addb_viewer.app.scene.clips import STEP_S, clip_of, film_of, gif, png


@pytest.mark.parametrize(
    ("rate", "speed"), [(100.0, 1.0), (120.0, 1.0), (250.0, 0.25), (30.0, 0.5), (100.0, 2.0)]
)
def test_each_picture_is_the_frame_nearest_to_its_moment(rate, speed):
    start, end = 40, 241
    shown = clip_of(start, end, rate, speed).frames
    moments = start + np.arange(len(shown)) * STEP_S * speed * rate
    assert np.abs(np.array(shown) - moments).max() <= 0.5 + 1e-9
    assert moments[-1] <= end - 1 < moments[-1] + STEP_S * speed * rate, "all of the range and no more"
    assert clip_of(start, end, rate, -speed).frames == shown[::-1]


def test_one_frame_is_one_picture():
    assert clip_of(7, 8, 100.0, 1.0).frames == film_of(7, 8, 100.0, 1.0).frames == (7,)


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


def test_a_gif_has_every_picture_for_its_time_and_repeats():
    levels = (0, 60, 120, 180, 180, 240)
    file = Image.open(io.BytesIO(gif([np.full((20, 30, 3), level, np.uint8) for level in levels])))
    assert file.info["loop"] == 0
    seen = []
    for k in range(file.n_frames):
        file.seek(k)
        seen += [file.convert("L").getpixel((5, 5))] * round(file.info["duration"] / (1000 * STEP_S))
    assert len(seen) == len(levels), "pictures that are alike may be one, for the sum of their times"
    assert np.abs(np.subtract(seen, levels)).max() <= 1


def test_a_picture_keeps_its_transparent_ground():
    rgba = np.zeros((4, 6, 4), np.uint8)
    rgba[1, 2] = (200, 100, 50, 255)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(png(rgba)))), rgba)
