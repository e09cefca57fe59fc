"""Pictures and clips of the scene as files: which frames a clip shows when, and its bytes."""

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8
from PIL import Image

STEP_S = 0.04  # between two pictures of a clip: a GIF counts in hundredths of a second, so this is exact
LONGEST_S = 30.0  # of a clip
QUALITY = 95  # of JPEG's hundred
FASTEST_HZ = 60.0  # pictures of a film: more than screens show are left out
COLORS, SAMPLES = 255, 8  # of a clip; pictures of it that the colours are chosen by


@dataclass(frozen=True)
class Clip:
    """Frames of a trial in the order in which they are shown."""

    frames: tuple[int, ...]
    rate: float  # [Hz] of the pictures


def clip_of(start: int, end: int, rate: float, speed: float) -> Clip:
    """Frames start to end − 1 as they would be seen at a speed: of each picture's moment the nearest frame.

    Args:
        start: first frame.
        end: the first frame after it.
        rate: of the trial [Hz].
        speed: in units of real time; negative backwards.
    """
    step = STEP_S * abs(speed) * rate  # frames from one picture to the next
    count = int((end - 1 - start) / step + 1e-9) + 1
    frames = start + np.rint(np.arange(count) * step).astype(int)
    return Clip(tuple(int(f) for f in (frames if speed > 0 else frames[::-1])), 1 / STEP_S)


def film_of(start: int, end: int, rate: float, speed: float) -> Clip:
    """Every n-th frame of start to end − 1, n as small as screens can follow, so that times are exact.

    Arguments as for `clip_of`.
    """
    every = int(np.ceil(rate * abs(speed) / FASTEST_HZ - 1e-9))
    frames = range(start, end, every)
    return Clip(tuple(frames if speed > 0 else reversed(frames)), rate * abs(speed) / every)


def png(rgba: UInt8[np.ndarray, "height width 4"]) -> bytes:
    """One picture, on transparent ground."""
    stream = io.BytesIO()
    Image.fromarray(rgba, "RGBA").save(stream, "PNG", optimize=True)
    return stream.getvalue()


def jpeg(rgb: UInt8[np.ndarray, "height width 3"]) -> bytes:
    """One picture of a film, before it is coded."""
    stream = io.BytesIO()
    Image.fromarray(rgb, "RGB").save(stream, "JPEG", quality=QUALITY)
    return stream.getvalue()


def gif(pictures: Sequence[UInt8[np.ndarray, "height width 3"]]) -> bytes:
    """A clip that is repeated, each picture for `STEP_S`; all share their colours, so none flickers."""
    some = np.unique(np.linspace(0, len(pictures) - 1, SAMPLES).astype(int))
    palette = Image.fromarray(np.concatenate([pictures[k] for k in some]), "RGB").quantize(COLORS)
    first, *rest = (
        Image.fromarray(picture, "RGB").quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in pictures
    )
    stream = io.BytesIO()
    # Pictures that are alike become one, which is shown for the sum of their times.
    first.save(
        stream, "GIF", save_all=True, append_images=rest, duration=round(1000 * STEP_S), loop=0, disposal=1,
        optimize=False,
    )  # fmt: skip
    return stream.getvalue()
