"""The rows on a balance made by hand: a body of two segments whose forces are known to the last newton."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hidden.format import CAUSES
from benchmarks.hidden.ordinary import LOADED, TOUCHED, MarkerBalance, best_single_cause, with_torso_shifted
from benchmarks.hidden.page import TITLES, section
from benchmarks.hidden.rows import answer_of, note_version, versions
from tests.benchmarks.test_hidden_scoring import truth

G = 9.80665
RATE, FRAMES = 100.0, 400
NAMES = tuple(dict.fromkeys((*LOADED, *TOUCHED)))
MASSES = np.array([30.0 if n == "torso" else 5.0 for n in NAMES])


def moving_bodies():
    """Positions and accelerations of point masses that swing, each by its own waves."""
    times, rng = np.arange(FRAMES) / RATE, np.random.default_rng(4)
    position, acceleration = np.zeros((2, FRAMES, len(NAMES), 3))
    for k in range(len(NAMES)):
        position[:, k] = (0.1 * k - 0.3, 0.4 + 0.1 * k, 0.05 * (-1) ** k)
        for axis in range(3):
            a, w, phase = rng.uniform(0.01, 0.04), rng.uniform(4.0, 9.0), rng.uniform(0, 6)
            position[:, k, axis] += a * np.sin(w * times + phase)
            acceleration[:, k, axis] = -a * w**2 * np.sin(w * times + phase)
    return times, position, acceleration


def sound(noise=0.5):
    """Plates read what Newton demands of the points, and a little noise."""
    times, position, acceleration = moving_bodies()
    force = MASSES[:, None] * (acceleration + np.array([0.0, G, 0.0]))
    com = np.einsum("b,fbi->fi", MASSES, position) / MASSES.sum()
    moment = np.cross(position - com[:, None], force).sum(axis=1)
    required = np.concatenate([force.sum(axis=1), moment], axis=1)
    known = np.arange(FRAMES) < 320
    spread = noise * np.array([1, 1, 1, 0.1, 0.1, 0.1])
    read = required + spread * np.random.default_rng(7).standard_normal(required.shape)
    forward, sideways = read[:, 5] / read[:, 1], -read[:, 3] / read[:, 1]
    under = np.stack([com[:, 0] + forward, 0 * times, com[:, 2] + sideways], axis=1)
    return MarkerBalance(
        trial="walk",
        times=times,
        com=com,
        required=required,
        plates=np.where(known[:, None], read, 0.0)[None],
        pressure=under[None],
        known=known,
        body_names=NAMES,
        body_masses=MASSES,
        body_com=position,
        body_R=np.tile(np.eye(3), (FRAMES, len(NAMES), 1, 1)),
    )


def reading(balance, wrench):
    return replace(balance, plates=np.where(balance.known[:, None], wrench, 0.0)[None])


def late(balance, by_s):
    """Forces recorded late: read at earlier times, about the ground origin."""
    read = balance.about_origin(balance.measured)
    clean = balance.about_origin(balance.required) + 0 * read
    moved = np.stack([np.interp(balance.times - by_s, balance.times, c) for c in clean.T], axis=1)
    noise = balance.measured - balance.required
    force = moved[:, :3]
    about = np.concatenate([force, moved[:, 3:] - np.cross(balance.com, force)], axis=1)
    return reading(balance, about + np.where(balance.known[:, None], noise, 0.0))


def test_sound_forces_are_called_sound():
    probabilities, best = best_single_cause([sound()])
    assert best.id == "none"
    assert sum(probabilities.values()) == pytest.approx(1.0)
    assert max(probabilities, key=probabilities.get) == "none"


def test_a_late_clock_is_named_with_its_delay():
    _, best = best_single_cause([late(sound(), 0.02)])
    assert best.id == "clock_offset"
    assert best.parameters["offset_s"] == pytest.approx(0.02, rel=0.1)


def test_a_lift_at_the_pelvis_is_named_and_taken_off_the_held_out_forces():
    balance = sound()
    lift = np.zeros((FRAMES, 6))
    lift[:, 1] = 60.0
    arm = balance.body_com[:, NAMES.index("pelvis")] - balance.com
    lift[:, 3:] = np.cross(arm, lift[:, :3])
    _, best = best_single_cause([reading(balance, balance.measured - lift)])
    assert best.id == "body_weight_support"
    assert best.parameters["force_N"] == pytest.approx(60.0, rel=0.05)
    left = best.left_out[0][~balance.known]
    np.testing.assert_allclose(left, lift[~balance.known], atol=3.0)


def test_a_plate_that_lies_elsewhere_is_named_with_its_shift():
    balance = sound()
    moved = np.zeros((FRAMES, 6))
    moved[:, 3:] = np.cross([0.02, 0.0, -0.01], balance.measured[:, :3])
    _, best = best_single_cause([reading(balance, balance.measured + moved)])
    assert best.id == "plate_position"
    assert best.parameters == pytest.approx({"shift_x_m": 0.02, "shift_z_m": -0.01}, abs=0.001)


def test_a_shifted_torso_balances_the_mean_and_keeps_what_is_sound():
    balance = sound()
    lighter = reading(balance, balance.measured - np.array([0, 30.0, 0, 2.0, 0, -4.0]))
    (shifted,) = with_torso_shifted([lighter])
    mean = (shifted - lighter.measured)[balance.known].mean(axis=0)
    np.testing.assert_allclose(mean[[1, 3, 5]], 0.0, atol=1e-9)
    (kept,) = with_torso_shifted([sound(noise=0.0)])
    np.testing.assert_allclose(kept, sound(noise=0.0).required, atol=1e-3)


def diagnosis(effects=(), alternatives=(), **more):
    return {"verdict": "explained", "effects": list(effects), "alternatives": list(alternatives)} | more


def named(id, confidence, outside=0.0):
    return {"id": id, "confidence": confidence, "outside_the_list": outside, "parameters": {}}


def test_our_answer_in_public_names():
    chances = {"nothing": 0.7, "on_the_list": 0.2, "something_else": 0.1}
    refused = [{"id": "drag", "odds_nats": 1.0}, {"id": "clock_offset", "odds_nats": 3.0}]
    told = answer_of(diagnosis(chances=chances, decisions=refused))["probabilities"]
    assert told == pytest.approx({"none": 0.7, "something_else": 0.1, "clock_offset": 0.2})
    told = answer_of(diagnosis(chances=chances, decisions=[]))["probabilities"]
    assert told == pytest.approx({"none": 0.7, "something_else": 0.3})
    alone = answer_of(diagnosis(effects=[named("plate_clock", 0.98, 0.01)]))["probabilities"]
    assert (alone["clock_offset"], alone["something_else"]) == (0.98, 0.01)
    unlisted = [chance for name, chance in alone.items() if name not in ("clock_offset", "something_else")]
    assert unlisted == pytest.approx([0.01 / (len(CAUSES) - 2)] * (len(CAUSES) - 2))
    both = [named("plate_turn", 0.6), named("drag", 0.9)]
    rivals = [{"id": "plate_yaw", "confidence": 0.3}]
    shared = answer_of(diagnosis(effects=both, alternatives=rivals))["probabilities"]
    told = {name: chance for name, chance in shared.items() if chance}
    assert told == pytest.approx({"something_else": 0.6, "drag": 0.3, "plate_yaw": 0.1})


def test_rivals_keep_their_own_chances_in_public():
    """Two targets of one cause do not get ahead of what is named by what other rivals would have had."""
    rivals = [{"id": "segment_mass", "confidence": 0.2}, {"id": "segment_mass", "confidence": 0.1}]
    answer = answer_of(diagnosis(effects=[named("subject_mass", 0.4)], alternatives=rivals))["probabilities"]
    assert max(answer, key=lambda name: answer[name]) == "subject_mass"
    assert answer["segment_mass"] == pytest.approx(0.3)
    assert sum(answer.values()) == pytest.approx(1.0)


def test_the_page_judges_ours_on_all_and_every_row_on_what_all_answered(tmp_path):
    (tmp_path / "truth").mkdir()
    for case in ("case_0000", "case_0001"):
        (tmp_path / "truth" / f"{case}.json").write_text(
            json.dumps(truth(case, parameters={"time_shift_s": 0.012}))
        )
        (tmp_path / "out" / case).mkdir(parents=True)
        for row in TITLES:
            if case == "case_0001" and row == "torso-shift":
                continue
            (tmp_path / "results" / row).mkdir(parents=True, exist_ok=True)
            said = {"probabilities": {"clock_offset": 0.9, "none": 0.1}}
            (tmp_path / "results" / row / f"{case}.json").write_text(json.dumps(said))
    note_version(tmp_path / "results")
    note_version(tmp_path / "results")
    (version,) = versions(tmp_path / "results")
    text = section(tmp_path / "out", tmp_path / "truth", tmp_path / "results")
    assert f"page`, code {version}: 2 of 2 cases that were drawn,\n2 inside the list" in text
    assert "On the 1 cases that every row has answered: 1 inside the list, 0 outside it, 0 clean." in text
    own, beside = text.split("## Beside")
    assert "| inside the list: right | 100 % [34, 100] (2/2) |" in own
    assert "| inside | clock_offset | 2 | 2 |  |  |  |  |" in own
    assert "| walk | × 1 | 100 % [34, 100] (2/2) | 100 % [34, 100] (2/2) |" in own
    assert "| 90 % | 100 % [34, 100] (2/2) |" in own
    right = next(line for line in beside.splitlines() if line.startswith("| inside the list: right"))
    assert right.count("100 % [21, 100] (1/1)") == 2
    assert right.endswith("| - | - |")
