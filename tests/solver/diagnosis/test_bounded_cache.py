"""What is kept takes no more than it may."""

from functools import partial

import numpy as np

from solver.diagnosis.bounded_cache import Memory

KILOBYTE = np.zeros(125)


def test_what_is_there_is_not_made_again():
    kept, one, other = Memory(1e6), object(), object()
    made = kept.get(lambda: (KILOBYTE.copy(), None), "values", one, other)
    assert kept.get(lambda: (KILOBYTE.copy(), None), "values", one, other) is made
    assert kept.get(lambda: (KILOBYTE.copy(), None), "values", other, one) is not made
    assert kept.get(lambda: (KILOBYTE.copy(), None), "others", one, other) is not made
    assert kept.bytes == 3000


def test_the_longest_unused_goes_first():
    kept, of = Memory(3500), [object() for _ in range(4)]
    for one in of[:3]:
        kept.put(KILOBYTE, "values", one)
    kept.get(KILOBYTE.copy, "values", of[0])
    kept.put(KILOBYTE, "values", of[3])
    assert [kept.has("values", one) for one in of] == [True, False, True, True]
    assert kept.bytes == 3000


def test_what_is_put_anew_is_counted_once_and_what_is_too_large_stays_until_the_next():
    kept, one, other = Memory(2500), object(), object()
    kept.put(KILOBYTE, "values", one)
    kept.put(np.zeros(500), "values", one)
    assert (kept.bytes, kept.has("values", one)) == (4000, True)
    kept.put(KILOBYTE, "values", other)
    assert (kept.bytes, kept.has("values", one), kept.has("values", other)) == (1000, False, True)


def test_an_object_lives_as_long_as_what_was_made_of_it():
    kept = Memory(1e6)
    for k in range(50):  # addresses of objects that are gone are given to new ones
        assert kept.get(partial(np.full, 3, k), "values", object())[0] == k
