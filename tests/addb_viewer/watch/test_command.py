"""`addb-viewer watch` as a laboratory uses it: started, killed, started again; lines for other programs."""

import csv
import json
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.commands.watch import BELLS, Webhook, _keep_table
from addb_viewer.watch.verdict_log import Colour, Stage, VerdictLine, log_folder, read_log
from tests.patience import PATIENCE_S

LINE = VerdictLine("walk", "a", Stage.VERDICT, Colour.GREEN, "w", "t", "2026-11-29T10:00:00Z", 2.0)


@pytest.mark.parametrize("url", ["ftp://lab/verdicts", "file:///etc/passwd", "lab/verdicts", "http://"])
def test_a_webhook_is_on_the_web(tmp_path, url):
    said = CliRunner().invoke(app, ["watch", str(tmp_path), "--webhook", url])
    assert said.exit_code == 2
    assert "is no address that begins with" in " ".join(said.output.replace("│", "").split())


def test_a_webhook_gets_json_and_a_failure_is_said_once(capsys):
    got = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            got.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    hook = Webhook(f"http://127.0.0.1:{server.server_address[1]}/")
    hook._post({"trial": "walk", "subject": "S01"})
    server.shutdown()
    server.server_close()
    assert got == [{"trial": "walk", "subject": "S01"}]
    hook._post({})
    hook._post({})
    assert capsys.readouterr().err.count("a verdict could not be sent") == 1


def test_every_colour_rings_otherwise():
    assert len(set(BELLS.values())) == len(BELLS) == len(Colour)


def test_the_table_has_a_line_a_verdict_also_of_files_that_were_replaced(tmp_path):
    new = replace(LINE, files="b", words="=1+1", good=True, right_steps=2)
    lines = {tmp_path / "S01": [replace(LINE, stage=Stage.FIRST), LINE, new]}
    _keep_table(tmp_path / "t.csv", type("Session", (), {"lines": lines}))
    rows = list(csv.DictReader((tmp_path / "t.csv").open()))
    assert [(row["subject"], row["words"], row["right_steps"]) for row in rows] == [
        ("S01", "w", "0"),
        ("S01", "=1+1", "2"),
    ]


def started(folder, *words):
    command = [sys.executable, "-m", "addb_viewer", "watch", str(folder), "--port", "0", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.1)


@pytest.mark.slow
@pytest.mark.real
def test_a_real_walk_gets_one_verdict_though_the_watcher_is_killed_meanwhile(tmp_path, real_data):
    watched, table = tmp_path / "lab", tmp_path / "verdicts.csv"
    watched.mkdir()
    source, place = real_data / "walk_rajagopal2015", watched / "S01"
    running = started(watched)
    place.mkdir()
    for name, own in (
        ("static_walk_1.trc", "static.trc"),
        ("markers.trc", "walk.trc"),
        ("grf.mot", "walk_grf.mot"),
    ):
        shutil.copyfile(source / name, place / own)
    log = log_folder(place / "results")
    until(lambda: any(line.stage is Stage.FIRST for line in read_log(log)))
    running.send_signal(signal.SIGKILL)
    running.wait()
    running = started(watched, "--csv", str(table), "--poll")
    until(lambda: any(line.stage is Stage.VERDICT for line in read_log(log)))
    until(table.exists)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=PATIENCE_S)
    assert (running.returncode, err) == (0, "")
    assert "stopped watching" in out
    stages = [line.stage for line in read_log(log) if line.trial == "walk"]
    assert (stages.count(Stage.FIRST), stages.count(Stage.VERDICT)) == (1, 1)
    verdict = read_log(log)[-1]
    assert verdict.to_do == "Nothing to repeat, unless step 1 and step 5 were to be on a plate"
    rows = [row["to_do"] for row in csv.DictReader(table.open()) if row["trial"] == "walk"]
    assert rows == [verdict.to_do]
    assert not (place / "results" / "fit.json").exists()
