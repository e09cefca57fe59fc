"""What the page may answer to a question: the dialog that is open, by one of its buttons."""

from types import SimpleNamespace

import pytest

from addb_viewer.app.page.channel import Channel
from addb_viewer.app.page.questions import Questions

NONSENSE = (None, [], "yes", {}, {"dialog": 1}, {"dialog": "1", "button": 1, "text": ""})
STALE = tuple({"dialog": n, "button": k, "text": ""} for n, k in ((0, 1), (2, 1), (1, -1), (1, 7)))


@pytest.mark.parametrize("said", [*NONSENSE, *STALE])
def test_only_a_button_of_the_open_dialog_is_an_answer(said):
    channel, done = Channel(), []
    questions = Questions(channel, SimpleNamespace(obey=lambda doing, action: action()))
    questions.ask("Discard?", ["It is Bo's."], "Discard", lambda: done.append("discarded"))
    channel.take("answer", said)
    assert questions.waits
    channel.take("answer", {"dialog": 1, "button": 1, "text": ""})
    channel.take("answer", {"dialog": 1, "button": 1, "text": ""})  # pressed twice
    assert done == ["discarded"]
    assert channel.shown("dialog") is None
