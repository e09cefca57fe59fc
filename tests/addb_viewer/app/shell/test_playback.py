import threading
import time

import pytest

from addb_viewer.app.shell.playback import HELD_S, LONGEST_WAIT_S, PICTURES_PER_SECOND, Pace, Playback
from tests.patience import PATIENCE_S


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def playback(clock):
    """101 frames at 100 Hz; nothing draws."""
    p = Playback(lambda position: None, clock)
    p.open(101, 100.0)
    return p


def test_playing_follows_the_clock_at_the_chosen_speed(playback, clock):
    playback.toggle()
    clock.now = 0.25
    assert playback.position.frame == 25
    playback.slower()
    clock.now = 0.45
    assert playback.position.frame == 35
    assert playback.position.playing


def test_it_stops_at_the_end_and_starts_over(playback, clock):
    playback.toggle()
    clock.now = 5.0
    assert playback.position.frame == 100
    assert not playback.position.playing
    playback.toggle()
    clock.now = 5.1
    assert playback.position.frame == 10


def test_backwards_from_the_start_begins_at_the_end(playback, clock):
    playback.slower()
    assert playback.position.speed == -1.0
    assert playback.position.frame == 100
    clock.now = 0.1
    assert playback.position.frame == 90


def test_pausing_keeps_the_frame(playback, clock):
    playback.toggle()
    clock.now = 0.333
    playback.toggle()
    clock.now = 9.0
    assert playback.position.frame == 33
    assert not playback.position.playing


def test_steps_pause_and_stay_inside(playback, clock):
    playback.toggle()
    clock.now = 0.2
    playback.step(1)
    assert (playback.position.frame, playback.position.playing) == (21, False)
    playback.step(-1000)
    assert playback.position.frame == 0
    playback.step_seconds(0.5)
    assert playback.position.frame == 50
    playback.step_seconds(-0.001)
    assert playback.position.frame == 49
    playback.seek(10**6)
    assert playback.position.frame == 100


def test_l_and_j_walk_through_the_speeds(playback):
    speeds = []
    for press in [
        playback.faster,
        playback.faster,
        playback.slower,
        playback.slower,
        playback.slower,
        playback.slower,
    ]:
        press()
        speeds.append(playback.position.speed)
    assert speeds == [1.0, 2.0, 1.0, 0.5, 0.25, -0.25]


def test_the_speed_stays_while_nothing_plays(playback, clock):
    for press in (playback.toggle, playback.faster, playback.pause):
        press()
    assert not playback.position.playing
    playback.toggle()
    clock.now = 0.25
    assert playback.position.frame == 50


def test_another_trial_starts_at_its_first_frame(playback, clock):
    playback.seek(70)
    playback.open(50, 200.0)
    assert (playback.position.frame, playback.frames) == (0, 50)


def test_one_thread_draws_no_more_often_than_it_may():
    rate, drawn, threads, enough = 1000.0, [], set(), threading.Event()

    def draw(position):
        threads.add(threading.get_ident())
        drawn.append((position.frame, time.perf_counter() - began))
        if len(drawn) > PICTURES_PER_SECOND / 2:
            enough.set()

    playback = Playback(draw)
    playback.open(1_000_000, rate)
    began = time.perf_counter()
    playback.start()
    playback.toggle()
    late_s = time.perf_counter() - began  # at most, by which it began to play after us
    assert enough.wait(PATIENCE_S)
    playback.stop()
    frames, at_s = zip(*drawn, strict=True)
    assert len(drawn) <= PICTURES_PER_SECOND * at_s[-1] + 3  # two are asked for and may come at once
    assert all(frame <= rate * at for frame, at in drawn)
    assert all(frame >= rate * (at - late_s) - 1 for frame, at in zip(frames[1:], at_s[:-1], strict=True))
    assert threads != {threading.get_ident()}
    assert len(threads) == 1


def test_a_loop_shows_a_frame_for_a_moment_and_then_runs_until_it_is_ended(playback, clock):
    playback.show_loop(20, 40, 33)
    clock.now = 0.99 * HELD_S
    assert (playback.position.frame, playback.position.held) == (33, True)
    clock.now = HELD_S + 0.05
    assert (playback.position.frame, playback.position.held) == (38, False)
    clock.now = HELD_S + 0.10
    assert playback.position.frame == 23
    playback.end_loop()
    clock.now += 1.0
    assert (playback.position.frame, playback.position.playing) == (23, False)


def test_another_loop_begins_at_its_own_frame_and_one_frame_is_no_loop(playback, clock):
    playback.show_loop(20, 40, 33)
    clock.now = HELD_S + 0.01
    playback.show_loop(60, 80, 62)
    assert playback.position.frame == 62
    clock.now += HELD_S + 0.03
    assert playback.position.frame == 65
    playback.show_loop(90, 91, 90)
    assert not playback.position.playing
    playback.toggle()
    playback.end_loop()
    assert playback.position.playing, "what plays the whole trial is no loop"


def test_many_wishes_end_at_the_last():
    seen = threading.Event()
    playback = Playback(lambda position: seen.set() if position.frame == 77 else None)
    playback.open(100, 100.0)
    playback.start()
    for frame in [*range(60), 77]:
        playback.seek(frame)
    assert seen.wait(PATIENCE_S)
    playback.stop()


def test_a_picture_waits_for_a_key_but_not_for_ever():
    pace, drawn_at, drawn = Pace(), [], threading.Event()

    def draw():
        with pace.turn():
            drawn_at.append(time.monotonic())
            drawn.set()

    with pace.first():
        began = time.monotonic()
        thread = threading.Thread(target=draw)
        thread.start()
        assert drawn.wait(PATIENCE_S)
    thread.join()
    assert drawn_at[0] - began >= LONGEST_WAIT_S


def test_what_waits_is_done_one_after_the_other_and_keys_go_ahead():
    pace, inside, most = Pace(), [], []
    at_work, go = threading.Event(), threading.Event()

    def work():
        with pace.turn():
            inside.append(1)
            most.append(len(inside))
            at_work.set()
            go.wait(PATIENCE_S)
            inside.pop()

    threads = [threading.Thread(target=work) for _ in range(6)]
    for thread in threads:
        thread.start()
    assert at_work.wait(PATIENCE_S)
    with pace.first():
        meanwhile = len(inside)
        go.set()
    for thread in threads:
        thread.join()
    assert most == [1] * 6
    assert meanwhile == 1  # the key has waited for nobody
