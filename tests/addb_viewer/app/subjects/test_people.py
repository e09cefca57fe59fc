import threading

import pytest

from addb_viewer.app.page.questions import checked_name
from addb_viewer.app.queue.queue_rows import Row, next_trial
from addb_viewer.app.subjects.people import People
from annotations.review_errors import ReviewError

ROWS = [Row("S1", f"walk {k}") for k in range(40)]


class Page:
    """A listener that remembers."""

    def __init__(self):
        self.said, self.drawn = [], 0

    def queue_changed(self):
        self.drawn += 1

    def told(self, title, body):
        self.said.append(title)


@pytest.fixture
def people():
    return People()


@pytest.fixture
def arrive(people):
    def arrived(page, name, browser=None):
        listener = Page()
        people.arrive(page, name, browser or f"browser {page}")
        people.listen(page, listener)
        return listener

    return arrived


def test_who_is_on_a_trial_is_known_to_the_others(people, arrive):
    for page, name in enumerate(("Ada", "Bo", "", "Bo")):
        arrive(page, name)
        people.go(page, ("S1", "walk"))
    assert people.others(0) == {("S1", "walk"): ("Bo (2 pages)", "somebody")}
    people.go(1, ("S2", "run"))
    people.leave(2)
    assert people.others(0) == {("S1", "walk"): ("Bo",), ("S2", "run"): ("Bo",)}


def test_pages_draw_anew_when_somebody_comes_moves_is_renamed_or_goes_and_only_then(people, arrive):
    ada = arrive(0, "Ada")
    drawn = ada.drawn
    arrive(1, "Bo")
    people.go(1, ("S1", "walk"))
    people.go(1, ("S1", "walk"))
    people.rename(1, "Eve")
    people.leave(1)
    people.leave(1)
    assert ada.drawn - drawn == 4


def test_two_browsers_of_one_name_are_told_both_but_not_two_pages_of_one_browser(people, arrive):
    ada, bo = arrive(0, "Ada"), arrive(1, "Bo")
    assert arrive(2, "Ada", "browser 0").said == []
    people.rename(1, "Ada")
    assert ada.said == bo.said == ["Two browsers decide as Ada"]
    assert arrive(3, "").said == arrive(4, "").said == []


def test_a_person_is_told_at_every_page(people, arrive):
    pages = [arrive(0, "Ada"), arrive(1, "Bo"), arrive(2, "Ada", "browser 0")]
    people.tell("Ada", "You disagree", "about a step")
    assert [page.said for page in pages] == [["You disagree"], [], ["You disagree"]]


def test_a_trial_is_offered_to_one_page_only_however_many_ask_at_once(people, arrive):
    pages = range(20)
    for page in pages:
        arrive(page, f"person {page}")
    start, offered = threading.Barrier(len(pages)), []

    def ask(page):
        start.wait()
        row = people.offer(page, lambda taken: next_trial(ROWS, None, taken))
        offered.append(row.trial)

    threads = [threading.Thread(target=ask, args=(page,)) for page in pages]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(offered)) == len(pages)
    people.leave(0)
    assert people.offer(99, lambda taken: next_trial(ROWS, None, taken)) is not None  # a page that has gone


@pytest.mark.parametrize(
    ("text", "name"), [(" Zoë ", "Zoë"), ("Ada\t Byron", "Ada Byron"), ("n" * 60, "n" * 60)]
)
def test_a_name_is_taken_without_its_blanks(text, name):
    assert checked_name(text) == name


@pytest.mark.parametrize("text", ["", "  \n", "imported", "n" * 61, "a\0b", "a\u202eb"])
def test_what_is_no_name_is_refused(text):
    with pytest.raises(ReviewError):
        checked_name(text)
