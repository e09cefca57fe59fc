"""The address of one browser's page: the frame that it was opened at, and the one on the screen."""

import contextlib
import json

import viser
from viser._messages import RunJavascriptMessage

from addb_viewer.app.security.trial_address import TrialAddress, address_in

PATIENCE_S = 3.0  # for the browser's answer
ITEM = "addb-viewer-at-{page}"  # of the browser's memory, for as long as the question takes
STORE = "localStorage.setItem('viser-user:{item}', location.search.slice(1))"
# A browser allows a hundred changes of the address in 30 s: what is scrubbed over is not written.
FOLLOW = """(() => {
  window.addbViewerAddress = null;
  setInterval(() => {
    const wanted = window.addbViewerAddress, shown = location.pathname + location.search;
    if (wanted && shown !== wanted) history.replaceState(history.state, "", wanted);
  }, 500);
})();"""


class AddressBar:
    """Names the frame on the screen. Only escaped text goes to the browser: a trial's name is never run."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._shown: TrialAddress | None = None

    def asked(self) -> TrialAddress | None:
        """The frame that the page was opened at; None where its address names none."""
        item, memory = ITEM.format(page=self._client.client_id), self._client.local_storage
        self._run(STORE.format(item=item))
        query = None
        with contextlib.suppress(RuntimeError, TimeoutError):  # a browser that keeps nothing
            query = memory.get_item(item, timeout=PATIENCE_S)
            memory.remove_item(item)
        self._run(FOLLOW)
        return address_in(query or "")

    def show(self, subject: str, trial: str, frame: int) -> None:
        """Another frame is on the screen."""
        address = TrialAddress(subject, trial, frame)
        if address != self._shown:
            self._shown = address
            self._run(f"window.addbViewerAddress = {json.dumps(str(address))};")

    def _run(self, script: str) -> None:
        self._client._websock_connection.queue_message(RunJavascriptMessage(source=script))
