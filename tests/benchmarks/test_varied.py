"""Settings halved and doubled: which are asked, what is said of each, and answers that are kept."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import binom, permutation_test

from benchmarks.varied import (
    CHANCE,
    LOOK,
    NOTHING,
    STANDS,
    Answer,
    asked,
    chance_of,
    evidence,
    number_tables,
    tables,
    variations,
    verdict,
)


@dataclass(frozen=True)
class SomeSettings:
    share: float = 0.4
    count: int = 1
    shown: bool = True
    nothing: float = 0.0
    other_m: float = 2.0


def test_half_and_double_of_every_number_that_is_not_left_out():
    found = list(variations(SomeSettings(), left_out=("other_",)))
    assert found[0] == ("SomeSettings", 1.0, SomeSettings())
    assert [(name, factor) for name, factor, _ in found[1:]] == [
        ("SomeSettings.share", 0.5), ("SomeSettings.share", 2.0),
        ("SomeSettings.count", 0.5), ("SomeSettings.count", 2.0),
    ]  # fmt: skip
    assert [one.share for _, _, one in found] == [0.4, 0.2, 0.8, 0.4, 0.4]
    assert [one.count for _, _, one in found] == [1, 1, 1, 1, 2]


def test_double_of_a_share_halves_what_is_missing_to_one():
    found = {
        (name, factor): one for name, factor, one in variations(SomeSettings(share=0.9), shares=("share",))
    }
    assert found["SomeSettings.share", 2.0].share == pytest.approx(0.95)
    assert found["SomeSettings.share", 0.5].share == 0.45


def answer(factor, wrong, changed):
    return Answer("SomeSettings.share", factor, wrong, changed)


USUAL = Answer("SomeSettings", 1.0, 0.10, 0.0)


def test_a_setting_stands_unless_another_value_makes_fewer_answers_wrong():
    def said(half, double, surely=()):
        return verdict(answer(0.5, *half), answer(2.0, *double), USUAL, surely)

    assert said((0.10, 0.0005), (0.10, 0.0)) == NOTHING
    assert said((0.11, 0.0005), (0.10, 0.0)) == STANDS
    assert said((0.12, 0.02), (0.10, 0.0)) == STANDS
    assert said((0.099, 0.02), (0.11, 0.0), {0.5}) == STANDS
    assert said((0.12, 0.02), (0.08, 0.03), {2.0}) == LOOK


def test_what_is_better_and_not_beyond_chance_may_be_chance():
    half, double = answer(0.5, 0.099, 0.02), answer(2.0, 0.08, 0.03)
    assert verdict(half, double, USUAL, ()) == CHANCE
    assert verdict(half, double, USUAL, {0.5}) == CHANCE  # sure, and not by enough


@pytest.mark.parametrize("seed", range(3))
def test_chance_is_the_share_of_exchanges_that_are_as_good(seed):
    gains = np.random.default_rng(seed).normal(0.3, size=9)
    found = permutation_test((gains,), np.sum, permutation_type="samples", alternative="greater")
    assert chance_of(gains) == pytest.approx(found.pvalue)


def test_all_of_some_are_better_by_chance_once_in_two_to_their_number():
    assert chance_of(np.array([0.1, 0.1, 0.3])) == 1 / 8
    assert chance_of(np.array([0.1, 0.1, -0.3])) == 5 / 8
    assert chance_of(np.array([])) == 1.0
    many = np.r_[np.full(15, 0.1), np.full(10, -0.1)]
    exact = binom.sf(14, 25, 0.5)  # as many gains of one size as there are, or more
    assert chance_of(many) == pytest.approx(exact, abs=0.005)


def of_persons(name, factor, wrong):
    parts = {str(k): one / len(wrong) for k, one in enumerate(wrong)}
    return Answer(name, factor, sum(parts.values()), 0.1, 100, parts)


TEN = [0.2] * 10
BETTER, ONE_BETTER, WORSE = [0.1] * 10, [0.0, *TEN[1:]], [0.3] * 10


def test_what_is_better_for_all_is_so_beyond_chance_and_for_one_it_is_not():
    usual = of_persons("Some", 1.0, TEN)
    answers = [of_persons("Some.all", 0.5, BETTER), of_persons("Some.one", 0.5, ONE_BETTER)]
    found = evidence(answers, lambda _: usual)
    every, one = found["Some.all", 0.5], found["Some.one", 0.5]
    assert (every.better, every.differ, every.p, every.q) == (10, 10, 2**-10, 2**-10)
    assert every.is_beyond_chance
    assert (one.better, one.differ, one.p, one.q) == (1, 1, 0.5, None)
    assert not one.is_beyond_chance


def test_among_many_values_few_that_are_better_may_be_so_by_chance():
    usual = of_persons("Some", 1.0, TEN)
    five = [*BETTER[:5], *TEN[5:]]  # better for all of whom it is otherwise: 1 of 32
    alone = evidence([of_persons("Some.five", 2.0, five)], lambda _: usual)
    assert alone["Some.five", 2.0].is_beyond_chance
    among = [of_persons(f"Some.{k}", factor, WORSE) for k in range(20) for factor in (0.5, 2.0)]
    beside = evidence([of_persons("Some.five", 2.0, five), *among], lambda _: usual)
    assert not beside["Some.five", 2.0].is_beyond_chance
    ten = evidence([of_persons("Some.ten", 2.0, BETTER), *among], lambda _: usual)["Some.ten", 2.0]
    assert ten.q == pytest.approx(41 / 2**10)
    assert ten.is_beyond_chance


def test_values_that_could_not_be_beyond_chance_are_left_out_of_the_count():
    usual = of_persons("Some", 1.0, TEN)
    idle = [of_persons(f"Some.{k}", 0.5, ONE_BETTER) for k in range(500)]
    assert (
        evidence([of_persons("Some.ten", 2.0, BETTER), *idle], lambda _: usual)["Some.ten", 2.0].q == 2**-10
    )


def test_a_page_has_each_under_its_heading_once_both_values_are_known():
    usual = of_persons("SomeSettings", 1.0, TEN)
    half, double = of_persons("SomeSettings.share", 0.5, WORSE), of_persons("SomeSettings.share", 2.0, BETTER)
    one = [of_persons("SomeSettings.count", factor, ONE_BETTER) for factor in (0.5, 2.0)]
    page = "\n".join(tables([usual, half, double, *one], {"SomeSettings": "some"}))
    _, stands, chance, look = page.split("## ")[1:]
    assert stands.startswith("Stands: 0")
    assert chance.startswith("May be chance: 1")
    assert "(better for 1 of 1 that differ, p 50.0 %)" in chance
    assert look.startswith("Asks for a look: 1")
    assert "| `some.share` | `SomeSettings.share` | × 0.5: 30.00 %, 10.00 % otherwise; × 2: 10.00 %" in look
    assert look.count("better for 10 of 10 that differ, p 0.1 %, q 0.2 %") == 1
    assert "SomeSettings.share" not in "\n".join(tables([usual, half], {"SomeSettings": "some"}))


def test_constants_are_held_to_the_one_answer_with_all_as_usual():
    usual = of_persons("Labels", 1.0, TEN)
    name = "part/module.py NUMBER"
    page = "\n".join(number_tables([of_persons(name, 0.5, WORSE), of_persons(name, 2.0, BETTER)], usual))
    assert "| `part/module.py` | `NUMBER` | × 0.5" in page.partition("## Asks for a look: 1")[2]


def test_answers_that_are_kept_are_not_asked_again(tmp_path):
    questions = []

    def told(variation):
        questions.append(variation[:2])
        return Answer(*variation[:2], 0.1, 0.0, 3, {"somebody": 0.1})

    first = asked(tmp_path / "of" / "answers", variations(SomeSettings()), told)
    assert len(questions) == len(first) == 7
    assert asked(tmp_path / "of" / "answers", variations(SomeSettings()), told) == first
    assert len(questions) == 7
