"""Which video goes with a trial, as kept with the subject."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from addb_viewer.app.subjects.videos import (
    KEPT,
    TrialVideo,
    VideoError,
    keep_video,
    kept_video,
    place_of,
    videos_in,
)


def test_what_is_kept_is_read_again_for_each_trial(tmp_path):
    video = TrialVideo("cameras/left Ü.mp4", 1.25, 8.0, -3.5)
    keep_video(tmp_path, "walk/1", video)
    keep_video(tmp_path, "run", TrialVideo("b.webm"))
    assert kept_video(tmp_path, "walk/1") == video
    keep_video(tmp_path, "run", None)
    assert kept_video(tmp_path, "run") is None
    assert kept_video(tmp_path, "walk/1") == video


def test_what_people_say_of_several_trials_at_once_is_all_kept(tmp_path):
    trials = [f"trial {k}" for k in range(40)]
    with ThreadPoolExecutor(len(trials)) as people:
        list(people.map(lambda trial: keep_video(tmp_path, trial, TrialVideo(f"{trial}.mp4")), trials))
    assert [kept_video(tmp_path, trial) for trial in trials] == [TrialVideo(f"{t}.mp4") for t in trials]


def test_its_clock_is_an_offset_a_rate_and_a_drift():
    slow = TrialVideo("a.mp4", offset_s=2.0, rate=8.0, drift_ms_per_min=30.0)
    assert slow.time_s(0.0) == 2.0
    assert slow.time_s(60.0) == pytest.approx(2.0 + 8.0 * 60.03)


@pytest.mark.parametrize(
    "video", [TrialVideo("a", float("nan")), TrialVideo("a", rate=0.0), TrialVideo("a", 0, 1, 1e9)]
)
def test_a_clock_that_is_none_is_not_kept(tmp_path, video):
    with pytest.raises(VideoError, match="can be"):
        keep_video(tmp_path, "walk", video)
    assert not (tmp_path / KEPT).exists()


@pytest.mark.parametrize(
    "text", ["{", "[]", '{"trials": {"walk": 3}}', '{"trials": {"walk": {"file": "a.mp4"}}}']
)
def test_a_table_that_cannot_be_read_stays_as_it_is(tmp_path, text):
    (tmp_path / KEPT).write_text(text)
    with pytest.raises(VideoError, match=KEPT):
        kept_video(tmp_path, "walk")
    if "file" not in text:
        with pytest.raises(VideoError):
            keep_video(tmp_path, "run", TrialVideo("b.mp4"))
        assert (tmp_path / KEPT).read_text() == text


def test_only_files_inside_the_subjects_folder_are_found_and_served(tmp_path):
    subject, outside = tmp_path / "subject", tmp_path / "secret.mp4"
    (subject / "cameras").mkdir(parents=True)
    outside.touch()
    for name in ("a.MP4", "cameras/b.avi", "notes.txt", "cameras/.c.mp4"):
        (subject / name).touch()
    (subject / "link.mp4").symlink_to(outside)
    (subject / "inside.webm").symlink_to(subject / "a.MP4")
    assert videos_in(subject) == ["a.MP4", "cameras/.c.mp4", "cameras/b.avi", "inside.webm"]
    for name in ("link.mp4", "../secret.mp4", str(outside), "gone.mp4", "notes.txt"):
        with pytest.raises(VideoError, match="not in the subject's folder"):
            place_of(subject, name)
    with pytest.raises(VideoError, match=r'browsers play MP4.*ffmpeg -i "b.avi"'):
        place_of(subject, "cameras/b.avi")
