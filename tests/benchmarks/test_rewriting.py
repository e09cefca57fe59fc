"""A constant at another value from when its module is read: also in what is made of it elsewhere."""

import subprocess
import sys
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from pathlib import Path

import numpy as np
import pytest

from benchmarks.rewriting import NoAnswerError, Number, answer_with, scaled, set_otherwise
from solver.diagnosis.witnesses.settings import WitnessSettings
from solver.dynamics.marker_noise import MarkerNoise
from solver.effects import plate_gain, segment_displaced


@dataclass(frozen=True)
class Sizes:
    word: str
    least_m: float
    frames: int
    enabled: bool = True


def test_every_number_is_scaled_and_nothing_else():
    assert scaled(0.5, 2.0) == 1.0
    assert (scaled(5, 0.5), scaled(1, 0.5), scaled(-4, 2.0), scaled(0, 2.0)) == (2, 1, -8, 0)
    assert scaled(("of", 1.5, {"a": [2.0, True]}, None), 2.0) == ("of", 3.0, {"a": [4.0, True]}, None)
    assert scaled(frozenset({3.0}), 0.5) == frozenset({1.5})
    np.testing.assert_array_equal(scaled(np.array([1.0, 2.0]), 2.0), [2.0, 4.0])
    assert scaled(Sizes("foot", 0.1, 3), 2.0) == Sizes("foot", 0.2, 6)


def test_a_curve_keeps_its_places():
    curve = ((0, 4), (0.5, -2.0), (1.0, 3.0))
    assert scaled({"knee": curve}, 2.0) == {"knee": ((0, 8), (0.5, -4.0), (1.0, 6.0))}
    assert scaled(((0.0, 4.0), (0.5, 2.0)), 2.0) == ((0.0, 8.0), (1.0, 4.0))
    assert scaled(((0.0, 1.0), (3.0, 2.0), (5.0, 2.0)), 2.0) == ((0.0, 2.0), (6.0, 4.0), (10.0, 4.0))


def test_of_a_cause_odds_and_sizes_change_and_the_way_it_is_told_does_not():
    usual = plate_gain.ABOUT
    other = scaled(usual, 2.0)
    assert other.odds_against == 2 * usual.odds_against
    assert [size.rare for size in other.sizes] == [2 * size.rare for size in usual.sizes]
    assert (other.readings, other.title, other.id) == (usual.readings, usual.title, usual.id)


def printed(script: str) -> list[str]:
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=root, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_everybody_who_knows_a_constant_has_the_new_value_in_that_process_alone():
    usual = segment_displaced.TOGETHER_S
    asks = """
from solver.diagnosis import marker_causes
from solver.diagnosis.witnesses.settings import WitnessSettings
from solver.dynamics.marker_noise import MarkerNoise
from solver.effects import plate_gain, segment_displaced
print(segment_displaced.TOGETHER_S, marker_causes.TOGETHER_S)
print(plate_gain.PlateGain.about.odds_against)
"""
    changed = printed(
        "from benchmarks.rewriting import Number, set_otherwise\n"
        "set_otherwise([Number('effects/segment_displaced.py', 'TOGETHER_S')], 2.0)\n"
        "set_otherwise([Number('effects/plate_gain.py', 'ABOUT')], 0.5)" + asks
    )
    odds = plate_gain.ABOUT.odds_against
    assert [float(word) for word in changed] == [2 * usual, 2 * usual, odds / 2]
    assert [float(word) for word in printed(asks)] == [usual, usual, odds]


def test_a_module_that_has_been_read_is_refused_and_so_is_a_name_that_it_lacks():
    with pytest.raises(RuntimeError, match="has been read"):
        set_otherwise([Number("effects/plate_gain.py", "LEAST")], 2.0)
    told = printed(
        "from benchmarks.rewriting import Number, set_otherwise\n"
        "set_otherwise([Number('effects/drag.py', 'NO_SUCH')], 2.0)\n"
        "try:\n    import solver.effects.drag\nexcept RuntimeError as error:\n    print(error)"
    )
    assert " ".join(told) == "effects/drag.py has no NO_SUCH"


def sum_of_leasts(more: float) -> float:
    return plate_gain.LEAST + more


def test_a_function_answers_in_a_process_of_its_own():
    number = Number("effects/plate_gain.py", "LEAST")
    usual = plate_gain.LEAST
    assert answer_with(None, 1.0, sum_of_leasts, {"more": 1.0}) == pytest.approx(1 + usual)
    assert answer_with(number, 2.0, sum_of_leasts, {"more": 1.0}) == pytest.approx(1 + 2 * usual)
    with pytest.raises(NoAnswerError, match="unsupported operand"):
        answer_with(number, 2.0, sum_of_leasts, {"more": "word"})
    assert usual == plate_gain.LEAST


def test_a_module_that_runs_as_a_script_is_called_by_its_name(monkeypatch):
    called = []

    def run(command, **_):
        called.append(command)
        return subprocess.CompletedProcess(command, 0, stdout="[]\n")

    monkeypatch.setattr("benchmarks.rewriting.subprocess.run", run)
    monkeypatch.setattr(sum_of_leasts, "__module__", "__main__")
    monkeypatch.setattr(sys.modules["__main__"], "__spec__", ModuleSpec("benchmarks.of_it", None))
    assert answer_with(None, 1.0, sum_of_leasts, {}) == []
    assert called[0][3] == "benchmarks.of_it:sum_of_leasts"


def test_a_process_that_somebody_ended_is_no_answer(monkeypatch):
    def killed(command, **_):
        return subprocess.CompletedProcess(command, -9, stdout="")

    monkeypatch.setattr("benchmarks.rewriting.subprocess.run", killed)
    with pytest.raises(RuntimeError, match="signal 9"):
        answer_with(None, 1.0, sum_of_leasts, {})


def test_of_several_names_in_one_statement_the_one_is_changed():
    asks = "from solver.markers.label_parts import SURE, INSIDE; print(SURE, INSIDE)"
    sure, inside = (float(word) for word in printed(asks))
    change = (
        "from benchmarks.rewriting import Number, set_otherwise\n"
        "set_otherwise([Number('markers/label_parts.py', 'INSIDE')], 0.5)\n"
    )
    assert [float(word) for word in printed(change + asks)] == [sure, inside / 2]


def test_a_setting_has_another_default_and_the_others_of_its_class_do_not():
    usual = WitnessSettings()
    changed = printed(
        "from benchmarks.rewriting import Number, set_otherwise\n"
        "set_otherwise([Number('diagnosis/witnesses/settings.py', 'WitnessSettings.place_scatter_m')], 2.0)\n"
        "from solver.diagnosis.witnesses.settings import WITNESSES, WitnessSettings\n"
        "print(WITNESSES.place_scatter_m, WitnessSettings().place_usual_m)"
    )
    assert [float(value) for value in changed] == [2 * usual.place_scatter_m, usual.place_usual_m]
    several = printed(
        "from benchmarks.rewriting import Number, set_otherwise\n"
        "set_otherwise([Number('dynamics/marker_noise.py', 'MarkerNoise.smoothness')], 0.5)\n"
        "from solver.settings import Settings\n"
        "print(*Settings().diagnosis.markers.smoothness)"
    )
    assert [float(value) for value in several] == [0.5 * one for one in MarkerNoise().smoothness]


def test_several_numbers_are_others_at_once_also_of_one_module():
    usual = (segment_displaced.TOGETHER_S, plate_gain.ABOUT.odds_against, WitnessSettings().place_scatter_m)
    changed = printed(
        "from benchmarks.rewriting import Number, set_otherwise\n"
        "set_otherwise([Number('effects/segment_displaced.py', 'TOGETHER_S'),"
        " Number('effects/plate_gain.py', 'ABOUT'),"
        " Number('diagnosis/witnesses/settings.py', 'WitnessSettings.place_scatter_m'),"
        " Number('diagnosis/witnesses/settings.py', 'WitnessSettings.told_nats')], 2.0)\n"
        "from solver.effects import plate_gain, segment_displaced\n"
        "from solver.diagnosis.witnesses.settings import WITNESSES\n"
        "print(segment_displaced.TOGETHER_S, plate_gain.ABOUT.odds_against, WITNESSES.place_scatter_m)\n"
        "print(WITNESSES.told_nats)"
    )
    assert [float(value) for value in changed] == [2 * one for one in (*usual, WitnessSettings().told_nats)]
