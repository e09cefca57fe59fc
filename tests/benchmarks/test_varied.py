"""Settings halved and doubled: which are asked, what is said of each, and answers that are kept."""

from dataclasses import dataclass

from benchmarks.varied import LOOK, NOTHING, STANDS, Answer, asked, tables, variations, verdict


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


def answer(factor, wrong, changed):
    return Answer("SomeSettings.share", factor, wrong, changed)


USUAL = Answer("SomeSettings", 1.0, 0.10, 0.0)


def test_a_setting_stands_unless_another_value_makes_fewer_answers_wrong():
    assert verdict(answer(0.5, 0.10, 0.0005), answer(2.0, 0.10, 0.0), USUAL) == NOTHING
    assert verdict(answer(0.5, 0.11, 0.0005), answer(2.0, 0.10, 0.0), USUAL) == STANDS
    assert verdict(answer(0.5, 0.12, 0.02), answer(2.0, 0.10, 0.0), USUAL) == STANDS
    assert verdict(answer(0.5, 0.099, 0.02), answer(2.0, 0.11, 0.0), USUAL) == STANDS
    assert verdict(answer(0.5, 0.12, 0.02), answer(2.0, 0.08, 0.03), USUAL) == LOOK


def test_of_independent_answers_few_that_are_right_now_may_be_chance():
    def of_a_thousand(factor, wrong, changed):
        return Answer("part/module.py NUMBER", factor, wrong, changed, 1000)

    usual = of_a_thousand(1.0, 0.014, 0.0)
    same, three, twenty = (of_a_thousand(2.0, 0.014 - k / 1000, k / 1000) for k in (0, 3, 20))
    assert verdict(of_a_thousand(0.5, 0.02, 0.006), three, usual) == LOOK
    assert verdict(of_a_thousand(0.5, 0.02, 0.006), three, usual, by_chance=True) == STANDS
    assert verdict(same, twenty, usual, by_chance=True) == LOOK
    assert verdict(same, same, usual, by_chance=True) == NOTHING


def test_a_page_has_each_under_its_heading_once_both_values_are_known():
    half, double = answer(0.5, 0.12, 0.02), answer(2.0, 0.10, 0.0)
    page = "\n".join(tables([USUAL, half, double], {"SomeSettings": "some"}))
    _, stands, look = page.split("## ")[1:]
    assert stands.startswith("Stands: 1")
    assert "| `some.share` | `SomeSettings.share` | × 0.5: 12.00 %, 2.00 % otherwise; × 2: 10.00 %" in stands
    assert look.startswith("Asks for a look: 0")
    assert "SomeSettings.share" not in "\n".join(tables([USUAL, half], {"SomeSettings": "some"}))


def test_answers_that_are_kept_are_not_asked_again(tmp_path):
    questions = []

    def told(variation):
        questions.append(variation[:2])
        return Answer(*variation[:2], 0.1, 0.0)

    first = asked(tmp_path / "of" / "answers", variations(SomeSettings()), told)
    assert len(questions) == len(first) == 7
    assert asked(tmp_path / "of" / "answers", variations(SomeSettings()), told) == first
    assert len(questions) == 7
