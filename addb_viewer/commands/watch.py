"""`addb-viewer watch`: the verdict on every trial as it is recorded, in the terminal and on a page."""

import csv as csv_format
import io
import json
import sys
import time
from http.client import HTTPException
from pathlib import Path
from threading import Thread
from typing import Annotated
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import typer

from addb_viewer.app.security.access import is_loopback
from addb_viewer.commands.options import (
    DEFAULT_HOST,
    DEFAULT_PORT,
    Debug,
    Host,
    Out,
    Port,
    file_to_write,
    written,
)
from addb_viewer.jobs.command_errors import check_folder, errors_as_lines, warn
from addb_viewer.watch.live_page import LivePage, state_of
from addb_viewer.watch.verdict_log import Colour, Stage, VerdictLine
from addb_viewer.watch.watching import Session, name_of
from addb_viewer.watch.what_to_do import SIGNS
from solver.capture.atomic import write_whole
from solver.common.errors import SolverError
from solver.common.file_names import readable
from solver.common.operating_system import end_in_order
from solver.common.typed_json import plain

TICK_MS = 250
WEBHOOK_S = 5.0  # that the other side may take
BELLS = {Colour.GREEN: 1, Colour.YELLOW: 2, Colour.RED: 3, Colour.NONE: 0}
BELL_S = 0.3
COLUMNS = ("when", "subject", "trial", "stage", "colour", "words", "to_do")
COUNTED = ("good", "activity", "right_steps", "left_steps")


def _web_address(url: str | None) -> str | None:
    if url is not None and (urlsplit(url).scheme not in ("http", "https") or not urlsplit(url).hostname):
        raise typer.BadParameter(f"{url} is no address that begins with http:// or https://")
    return url


Folder = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER", help="A subject's folder, or one in which subjects' folders are or will be."
    ),
]
Poll = Annotated[
    bool, typer.Option("--poll", help="Look again and again: for network shares, which tell of no change.")
]
Csv = Annotated[
    Path | None, file_to_write("--csv", "Keep all verdicts in this table too, a line each.", written)
]
ToWebhook = Annotated[
    str | None,
    typer.Option(
        "--webhook", metavar="URL", help="Send each line there as JSON, by POST.", callback=_web_address
    ),
]
Sound = Annotated[
    bool,
    typer.Option(
        "--sound", help="Ring the terminal's bell: once for green, twice for yellow, three times for red."
    ),
]


def watch(
    folder: Folder,
    out: Out = None,
    poll: Poll = False,
    csv: Csv = None,
    webhook: ToWebhook = None,
    sound: Sound = False,
    host: Host = DEFAULT_HOST,
    port: Port = DEFAULT_PORT,
    debug: Debug = False,
) -> None:
    """Say what each trial is good for, and what to do now, as soon as it is recorded.

    The lines stand in the terminal and on the page /live, for a screen in the laboratory. Kept fits stay.
    """
    from watchfiles import watch as changes  # noqa: PLC0415 (no other command needs it)

    with errors_as_lines(debug):
        check_folder(folder)
        end_in_order()
        page, hook = LivePage(host, port), Webhook(webhook) if webhook else None

        def say(subject: str, line: VerdictLine, own: bool) -> None:
            typer.echo(_in_terminal(subject, line, session))
            if csv is not None:
                _keep_table(csv, session)
            if sound and line.is_last:
                Thread(target=_ring, args=(BELLS[line.colour],), daemon=True).start()
            if hook is not None and own:
                hook.send(subject, line)

        session = Session(folder, out, say=say, complain=warn)
        typer.echo(f"watching {folder}; the page for the laboratory: {page.address}   (Ctrl-C ends)")
        if not is_loopback(host):
            warn("everybody who reaches this machine can read the verdicts on the page")
        try:
            for changed in changes(
                folder,
                debounce=TICK_MS,
                step=50,
                rust_timeout=TICK_MS,
                yield_on_timeout=True,
                force_polling=poll or None,
            ):
                if changed:
                    session.news()
                session.tick()
                page.show(state_of(session))
        except (KeyboardInterrupt, SystemExit):
            typer.echo("stopped watching; trials without a verdict get theirs when it is started again")
        finally:
            session.close()
            page.close()


def _in_terminal(subject: str, line: VerdictLine, session: Session) -> str:
    """Sign, trial, what to do, verdict; then how far the plan is."""
    follows = {Stage.FIRST: " (first look)", Stage.FIT: " (fit alone)"}.get(line.stage, "")
    parts = (f"{SIGNS[line.colour]} {subject}/{line.trial}{follows}", line.to_do, line.words)
    said = readable(" | ".join(filter(None, parts)))
    shown = said if line.colour is Colour.NONE else typer.style(said, fg=line.colour.value)
    counts = [words for words, _ in session.plan_of(subject)] if line.is_last else []
    return f"{shown}\n    {', '.join(counts)}" if counts else shown


def _keep_table(file: Path, session: Session) -> None:
    """All verdicts of the logs, in order of time; whole or as it was, also where this is killed."""
    text = io.StringIO()
    rows = csv_format.writer(text, lineterminator="\n")
    rows.writerow((*COLUMNS, *COUNTED))
    said = [(name_of(s), line) for s, lines in session.lines.items() for line in lines if line.is_last]
    for subject, line in sorted(said, key=lambda one: one[1].when):
        values = {**plain(line), "subject": subject}
        rows.writerow([values[column] for column in (*COLUMNS, *COUNTED)])
    try:
        write_whole(file, text.getvalue())
    except SolverError as error:
        warn(str(error))


def _ring(times: int) -> None:
    for _ in range(times):
        sys.stdout.write("\a")
        sys.stdout.flush()
        time.sleep(BELL_S)


class Webhook:
    """An address that is sent each verdict; what fails is said once, until it works again."""

    def __init__(self, url: str) -> None:
        """Nothing has been sent.

        Args:
            url: http:// or https://.
        """
        self.url, self._failed = url, False

    def send(self, subject: str, line: VerdictLine) -> None:
        """Send a line; the watching waits for nobody."""
        Thread(target=self._post, args=({**plain(line), "subject": subject},), daemon=True).start()

    def _post(self, values: dict[str, object]) -> None:
        sent = Request(self.url, json.dumps(values).encode(), {"Content-Type": "application/json"})
        try:
            with urlopen(sent, timeout=WEBHOOK_S):
                self._failed = False
        except (OSError, ValueError, HTTPException) as error:
            if not self._failed:
                warn(f"{self.url}: a verdict could not be sent ({error}); later ones are tried, too")
            self._failed = True
