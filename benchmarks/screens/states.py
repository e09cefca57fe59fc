"""The states: which folder, which address, and what is pressed until it is seen."""

from collections.abc import Callable
from dataclasses import dataclass

from playwright.sync_api import Page

from benchmarks.screens.folders import TRIAL

Enter = Callable[[Page], None]
SECOND_STEP = 158  # frame of the demo's walk at which a foot stands beside the plates

FAILURE = (
    "Diagnosing",
    "trials/walk/grf.mot: line 2467: the file is cut off inside this row. Copy or export it again; to work "
    "with what is there, delete the row.",
)


@dataclass(frozen=True)
class State:
    """One thing to look at."""

    name: str
    folder: str  # a kind of `folders.MAKERS`
    enter: Enter
    path: str = f"/?at=./{TRIAL}/{SECOND_STEP}"
    beside: str | None = None  # somebody else who has the trial open
    failure: tuple[str, str] | None = None  # that is told: what failed, and why


def tab(page: Page, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).click()


def seen(page: Page) -> None:
    page.keyboard.press("v")


def on_tab(name: str, awaited: str | None = None) -> Enter:
    """The person in the picture, with a tab open on which something is seen."""

    def enter(page: Page) -> None:
        tab(page, name)
        if awaited is not None:
            page.locator(awaited).first.wait_for()
        seen(page)

    return enter


def to_a_proposal(page: Page) -> None:
    page.keyboard.press("n")
    page.locator("#addb-chips kbd").first.wait_for()
    page.keyboard.press("k")  # the picture is to be still


def proposals(page: Page) -> None:
    to_a_proposal(page)
    seen(page)


def solving(page: Page) -> None:
    to_a_proposal(page)
    page.keyboard.press("Backspace")
    tab(page, "Solve")
    page.keyboard.press("g")
    page.locator("#addb-bar progress").wait_for()
    seen(page)


def queue(page: Page) -> None:
    page.locator("#space .row:not([hidden]) a").nth(8).wait_for()


def two_people(page: Page) -> None:
    page.locator("#addb-chips").get_by_text("Ben").first.wait_for()
    seen(page)


def by_cycle(page: Page) -> None:
    tab(page, "Curves")
    page.get_by_role("button", name="by gait cycle").click()
    page.locator("#addb-plots figcaption", has_text="right (").first.wait_for()
    seen(page)


waiting = on_tab("Solve", "#addb-solve button")

STATES = (
    State("unfitted", "unfitted", on_tab("Fit")),
    State("solving", "solving", solving),
    State("waiting-solve", "waiting", waiting),
    State("ten-proposals", "ten proposals", proposals),
    State("diagnosis", "fitted", on_tab("Diagnosis", "#addb-diagnosis article >> nth=1")),
    State("curves", "fitted", on_tab("Curves", "#addb-plots figure")),
    State("curves-by-gait-cycle", "fitted", by_cycle),
    State("queue-of-500", "queue", queue, path="/queue"),
    State("two-people", "two people", two_people, beside="Ben"),
    State("error", "waiting", waiting, failure=FAILURE),
    State("tablet", "ten proposals", proposals),
)
