"""What a proposal of detection rests on, and how sure it is, as a reviewer reads it."""

import math
from collections.abc import Mapping

UNITS = {"_N": " N", "_m_s": " m/s", "_Nm": " N·m", "_m": " m", "_s": " s"}  # ending of a name: unit
LEAST = 1e-3  # of newtons, metres and shares
NOT_SHOWN = ("log_odds", "error_N")  # the certainty says the one, the other stands with the missing force


def evidence_words(numbers: Mapping[str, float]) -> str:
    """The numbers that a proposal rests on, with units.

    Args:
        numbers: `evidence` of a proposal, by name; the name ends in the unit.
    """
    return ", ".join(_said(name, numbers) for name in numbers if name not in NOT_SHOWN)


def plain(value: float) -> str:
    """Three digits, or all before the point: 1020, 57.3, 0.0412; never with an exponent."""
    digits = 2 - math.floor(math.log10(abs(value))) if value else 0
    text = f"{value:.{max(digits, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _said(name: str, numbers: Mapping[str, float]) -> str:
    value = numbers[name] if abs(numbers[name]) >= LEAST else 0.0
    match name:
        case "missing_N":
            spread = f" ± {numbers['error_N']:.0f}" if "error_N" in numbers else ""
            return f"{value:.0f}{spread} N missing"
        case "measured_N":
            return f"{value:.0f} N measured"
        case "missing_share":
            return f"{100 * abs(value):.0f} % of the force {'missing' if value >= 0 else 'too much'}"
        case "slip_m_s":
            return f"sole moves at {value:.2f} m/s"
        case "share_off_plates":
            return f"{100 * value:.0f} % of the sole off the plates"
        case "outside_m":
            return f"centre of pressure {100 * value:.0f} cm outside the sole"
        case "feet_on_one_plate":
            return "both feet on one plate"
    ending = next((ending for ending in UNITS if name.endswith(ending)), "")
    return f"{name.removesuffix(ending).replace('_', ' ')} {plain(value)}{UNITS.get(ending, '')}"
