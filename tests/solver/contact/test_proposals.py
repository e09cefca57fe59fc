from annotations.reasons import REASONS
from solver.contact import proposals


def test_every_reason_is_a_word_of_the_b3d_format():
    words = [value for name, value in vars(proposals).items() if name.isupper()]
    assert len(words) >= 10
    assert set(words) <= set(REASONS)
