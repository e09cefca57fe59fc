"""The one place that reaches into viser's page: a script for every browser that connects.

Written for viser 1.1.1. Without it the app still works; a click into the scene gives the keyboard back then.
"""

from importlib import resources

import viser
from viser._messages import RunJavascriptMessage


def hand_back_the_keyboard(server: viser.ViserServer) -> None:
    """Make keys work again right after a click on a checkbox, a list or a slider."""
    source = resources.files("addb_viewer.app").joinpath("release_focus.js").read_text(encoding="utf-8")

    def send(client: viser.ClientHandle) -> None:
        client._websock_connection.queue_message(RunJavascriptMessage(source=source))

    server.on_client_connect(send)
