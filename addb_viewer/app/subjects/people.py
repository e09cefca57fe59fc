"""Who is at the browsers of this server, under which name, and at which trial."""

import threading
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

from annotations.work import CommentThread

TrialPlace = tuple[str, str]  # subject and trial
SOMEBODY = "somebody"  # who has not said a name yet


class OfTrial(Protocol):
    """A row of the queue: it knows its trial."""

    @property
    def subject(self) -> str:
        """Its name."""

    @property
    def trial(self) -> str:
        """Its name."""


Offered = TypeVar("Offered", bound=OfTrial)


class Listener(Protocol):
    """A browser's session. Must return at once."""

    def queue_changed(self) -> None:
        """Rows of the queue, or who is where, are others now."""

    def told(self, title: str, body: str) -> None:
        """Something happened that this person should know."""


@dataclass(frozen=True)
class Person:
    """Somebody at a page."""

    name: str  # empty where nobody has said
    browser: str  # that remembers the name: two pages of one browser are one person
    place: TrialPlace | None = None  # on the screen
    listener: Listener | None = None

    @property
    def called(self) -> str:
        """The name as others read it."""
        return self.name or SOMEBODY


class People:
    """Everybody at a page of this server, by the number that the server gave the page."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._people: dict[int, Person] = {}
        self._watchers: tuple[Callable[[], None], ...] = ()  # of the queue, at no trial

    def arrive(self, page: int, name: str, browser: str) -> None:
        """A page has opened."""
        with self._lock:
            self._people[page] = Person(name, browser)

    def listen(self, page: int, listener: Listener) -> None:
        """The page is laid out: tell it from now on, and both of a namesake at another browser."""
        self._change(page, lambda person: replace(person, listener=listener))
        self._tell_namesakes(page)

    def rename(self, page: int, name: str) -> None:
        """The person has said another name; both are told where another browser has the same one."""
        self._change(page, lambda person: replace(person, name=name))
        self._tell_namesakes(page)

    def go(self, page: int, place: TrialPlace | None) -> None:
        """Another trial is on the screen."""
        self._change(page, lambda person: replace(person, place=place))

    def leave(self, page: int) -> None:
        """The page has closed."""
        with self._lock:
            gone = self._people.pop(page, None)
        if gone is not None:
            self.queue_changed()

    def offer(self, page: int, choose: Callable[[Collection[TrialPlace]], Offered | None]) -> Offered | None:
        """A trial for this page alone: nobody else is offered it, from now until the page goes elsewhere.

        Args:
            page: that goes there.
            choose: picks a row of the queue that is at none of the given places.
        """
        with self._lock:
            row = choose({p.place for other, p in self._people.items() if other != page and p.place})
            if row is not None and page in self._people:
                self._people[page] = replace(self._people[page], place=(row.subject, row.trial))
        return row

    def others(self, page: int) -> Mapping[TrialPlace, tuple[str, ...]]:
        """The names of all others, by the trial that they are on."""
        found: dict[TrialPlace, tuple[str, ...]] = {}
        for other, person in self._everybody().items():
            if other != page and person.place is not None:
                found[person.place] = (*found.get(person.place, ()), person.called)
        return {place: _counted(names) for place, names in found.items()}

    def tell(self, name: str, title: str, body: str) -> None:
        """Tell a person something, wherever they are."""
        for person in self._everybody().values():
            if person.name == name and person.listener is not None:
                person.listener.told(title, body)

    def watch(self, watcher: Callable[[], None]) -> Callable[[], None]:
        """Tell somebody at no trial when the queue changes, who returns at once; the result ends it."""
        with self._lock:
            self._watchers = (*self._watchers, watcher)

        def end() -> None:
            with self._lock:
                self._watchers = tuple(other for other in self._watchers if other is not watcher)

        return end

    @property
    def names(self) -> frozenset[str]:
        """Of all who have said one."""
        return frozenset(person.name for person in self._everybody().values() if person.name)

    def everywhere(self) -> Mapping[TrialPlace, tuple[str, ...]]:
        """The names of all, by the trial that they are on."""
        return self.others(-1)

    def tell_of_answer(self, thread: CommentThread, trial: str, by: str, text: str) -> None:
        """Tell those who spoke in a talk that it goes on."""
        for name in thread.people:
            if name != by:
                self.tell(name, f"{by} answers on {trial}", text)

    def queue_changed(self) -> None:
        """Let every page draw its queue anew."""
        for watcher in self._watchers:
            watcher()
        for person in self._everybody().values():
            if person.listener is not None:
                person.listener.queue_changed()

    def _everybody(self) -> dict[int, Person]:
        with self._lock:
            return dict(self._people)

    def _change(self, page: int, change: Callable[[Person], Person]) -> None:
        with self._lock:
            before = self._people.get(page)
            if before is None:  # it has closed meanwhile
                return
            after = self._people[page] = change(before)
        if after != before:
            self.queue_changed()

    def _tell_namesakes(self, page: int) -> None:
        people = self._everybody()
        here = people.get(page)
        if here is None or not here.name:
            return
        same = [p for p in people.values() if p.name == here.name and p.browser != here.browser]
        for person in (*same, here) if same else ():
            if person.listener is not None:
                person.listener.told(
                    f"Two browsers decide as {here.name}",
                    "If that is two people, one of you should take another name (Review, History): "
                    "it says whose a decision is, and which ones U takes back.",
                )


def _counted(names: Collection[str]) -> tuple[str, ...]:
    """Each name once, with how often where it is at several pages."""
    return tuple(name if n == 1 else f"{name} ({n} pages)" for name, n in sorted(Counter(names).items()))
