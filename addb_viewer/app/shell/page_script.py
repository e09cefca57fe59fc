"""The one place that reaches into viser's page: scripts for one browser.

Written for viser 1.1.1. Without them the app still works: a click into the scene gives the keyboard back, and
keys, sliders and the box "Go to" do what clicks on the timeline do.
"""

from importlib import resources

import viser
from viser._messages import RunJavascriptMessage

SCRIPTS = ("release_focus.js", "timeline_bridge.js")


def send_scripts(client: viser.ClientHandle) -> None:
    """Make keys work again right after a click, and clicks and drags work on the timeline and in lists."""
    for name in SCRIPTS:
        source = resources.files("addb_viewer.app.shell").joinpath(name).read_text(encoding="utf-8")
        client._websock_connection.queue_message(RunJavascriptMessage(source=source))
