"""Colours, told apart by people with any common colour blindness, on light and dark backgrounds.

Hues of Okabe & Ito, "Color Universal Design" (2008).
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8

from annotations.reasons import key_of

READABLE, PALER = 125.0, 0.4  # brightness that a dark page needs; share of white that is added below it
LEGIBLE = 4.5  # contrast of small text with what lies behind it: WCAG 2.2, 1.4.3 (AA)
SHADES = 20  # from a colour to black or white, of which the first legible one is taken


class Rgb(NamedTuple):
    """8 bits a channel."""

    r: int
    g: int
    b: int

    @property
    def css(self) -> str:
        """As a style sheet writes it."""
        return f"rgb({self.r}, {self.g}, {self.b})"

    @property
    def on_any_page(self) -> str:
        """As a style sheet writes it, paler on a dark page where it would be lost; black is white there."""
        if self == INK:
            return "light-dark(#000, #fff)"
        if 0.299 * self.r + 0.587 * self.g + 0.114 * self.b > READABLE:
            return self.css
        paler = Rgb(*(round(c + PALER * (255 - c)) for c in self))
        return f"light-dark({self.css}, {paler.css})"

    @property
    def as_text(self) -> str:
        """As a style sheet writes text: darker on a light page, paler on a dark one, until it is legible."""
        if self == INK:
            return self.on_any_page
        return f"light-dark({_legible(self, BLACK, LIGHT_PAGE).css}, {_legible(self, WHITE, DARK_PAGE).css})"

    @property
    def ink(self) -> "Rgb":
        """Black or white, whichever is read better on it."""
        return max(BLACK, WHITE, key=self.contrast)

    def contrast(self, other: "Rgb") -> float:
        """From 1 (the same brightness) to 21 (black on white), as WCAG 2.2 defines it."""
        darker, lighter = sorted((self._luminance, other._luminance))
        return (lighter + 0.05) / (darker + 0.05)

    @property
    def _luminance(self) -> float:
        r, g, b = (_intensity(c / 255) for c in self)
        return 0.2126 * r + 0.7152 * g + 0.0722 * b  # ITU-R BT.709

    @property
    def linear(self) -> "Rgb":
        """The same colour as light intensities: how viser's page takes the colours of arrows."""
        return Rgb(*(round(255 * _intensity(c / 255)) for c in self))

    def faded(self, opacity: float) -> str:
        """As a style sheet writes it, see-through."""
        return f"rgba({self.r}, {self.g}, {self.b}, {opacity:g})"


def _intensity(c: float) -> float:
    """SRGB's transfer function (IEC 61966-2-1)."""
    return c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4


def _legible(color: Rgb, end: Rgb, page: Rgb) -> Rgb:
    """The first shade on the way to black or white that is legible on a page."""
    shades = (
        Rgb(*(round(c + k / SHADES * (e - c)) for c, e in zip(color, end, strict=True)))
        for k in range(SHADES + 1)
    )
    return next(shade for shade in shades if shade.contrast(page) >= LEGIBLE)


BLACK, WHITE = Rgb(0, 0, 0), Rgb(255, 255, 255)
LIGHT_PAGE, DARK_PAGE = WHITE, Rgb(36, 36, 36)  # viser's

BLUE = Rgb(0, 114, 178)
ORANGE = Rgb(230, 159, 0)
VERMILION = Rgb(213, 94, 0)
GREEN = Rgb(0, 158, 115)
PURPLE = Rgb(204, 121, 167)
SKY = Rgb(86, 180, 233)
GREY = Rgb(128, 128, 128)
PALE = Rgb(190, 190, 190)
INK = Rgb(0, 0, 0)
BONE = Rgb(222, 211, 190)

CAUSE = Rgb(123, 63, 242)  # what a diagnosis names: arrows, lines; their black is lost on a dark page
CAUSE_SURFACE = Rgb(240, 228, 66)  # likewise: bones, balls
OTHER_SOLVE = SKY  # the skeleton of the solve that is compared with
OTHER_CURVE = INK  # its curves: no chart has any other in this colour
UNASSIGNED = ORANGE  # a force that goes to no foot
RESIDUAL = VERMILION
TOTAL = BLUE  # of all forces, at the centre of mass
UNSEEN = PALE  # a marker while it's lost
NO_MODEL = GREY  # a marker that nothing was fitted to
PLATES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION, GREY)  # in the plots, in the file's order

COUNTS, REVIEWED = (
    Rgb(84, 122, 148),
    Rgb(120, 128, 138),
)  # frames that figures cover; that somebody decided on

# Of the reasons' keys, in the app's lanes: the number stands on the block as well. No foot's, no residual's.
REASONS = {
    "1": ORANGE,
    "2": Rgb(150, 90, 30),
    "3": Rgb(40, 60, 110),
    "4": SKY,
    "5": BLUE,
    "6": Rgb(140, 140, 40),
    "7": Rgb(240, 228, 66),
    "8": GREY,
    "9": Rgb(170, 110, 110),
}

ERROR_FULL_SCALE = 0.04  # [m] Hicks et al. 2015: no marker farther than 4 cm
_RAMP = np.array([BLUE, SKY, ORANGE, VERMILION], dtype=float)


def foot_color(foot: str, index: int) -> Rgb:
    """Right green, left purple, by the name's ending; further feet in the order of the list."""
    name = foot.lower()
    if name.endswith(("_r", "right")) or name.startswith(("r_", "right")):
        return GREEN
    if name.endswith(("_l", "left")) or name.startswith(("l_", "left")):
        return PURPLE
    return (SKY, BLUE)[index % 2]


def reason_color(reason: str) -> Rgb:
    """In lanes and lists."""
    return REASONS.get(key_of(reason), GREY)


_LOAD_RAMP = np.array([BONE, ORANGE, VERMILION, (110, 30, 10)], dtype=float)  # darker with every step
LOAD_STEPS = 24  # shades that are told apart; bones change their colour no more often


def load_colors(share: Float[np.ndarray, "*bodies"]) -> UInt8[np.ndarray, "*bodies 3"]:
    """From bone over orange and vermilion to dark brown; bone where nothing is known (NaN).

    Args:
        share: of the largest value.
    """
    return _along(_LOAD_RAMP, np.nan_to_num(share))


def _along(
    ramp: Float[np.ndarray, "stops 3"], share: Float[np.ndarray, "*points"]
) -> UInt8[np.ndarray, "*points 3"]:
    place = np.clip(share, 0.0, 1.0) * (len(ramp) - 1)
    lower = np.minimum(place.astype(int), len(ramp) - 2)
    part = (place - lower)[..., None]
    return np.asarray(ramp[lower] * (1 - part) + ramp[lower + 1] * part).astype(np.uint8)


def error_colors(errors: Float[np.ndarray, "*markers"]) -> UInt8[np.ndarray, "*markers 3"]:
    """Blue at no error over orange to vermilion at 4 cm; grey where there is no model marker (NaN).

    Args:
        errors: distances between measured and model marker [m].
    """
    known = np.isfinite(errors)
    colors = _along(_RAMP, np.where(known, errors, 0.0) / ERROR_FULL_SCALE)
    return np.where(known[..., None], colors, np.array(NO_MODEL)).astype(np.uint8)
