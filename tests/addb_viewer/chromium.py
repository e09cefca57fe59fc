"""Debian's Chromium, as tests and benchmarks start it, and who is remembered to sit before it."""

import json
import shutil

# A person's own browser draws with the graphics card; here Chromium draws all by itself: the scene as a card
# would, the rest of the page straight away and not by way of a card that is not there.
FLAGS = [
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
    "--disable-gpu-rasterization",
    "--disable-background-networking",
]


def installed():
    """The program; None where there is none on PATH."""
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def remembering(reviewer, **more):
    """A page's first script: the browser remembers somebody, unless it remembers what a page told it."""
    item = "addb-viewer"
    memory = json.dumps(json.dumps({"reviewer": reviewer, **more}))
    return f'localStorage.getItem("{item}") ?? localStorage.setItem("{item}", {memory});'


def resting_box(locator):
    """Where something lies once the page has put everything in its place."""
    before = None
    while (box := locator.bounding_box()) != before or box is None:
        before = box
        locator.page.wait_for_timeout(500)
    return box
