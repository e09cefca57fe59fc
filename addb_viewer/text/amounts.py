"""How many and how long, as people say it."""

TO_95 = 1.96  # standard deviations each way that a band of 95 % reaches


def counted(count: int, noun: str) -> str:
    """As in "1 person" and "2 persons".

    Args:
        count: of them.
        noun: of one; its plural has an s.
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def kilograms(mass_kg: float, std_kg: float | None) -> str:
    """With the 95 % band, as in "71.2 ± 2.1 kg".

    Args:
        mass_kg: of something.
        std_kg: its standard deviation; None: unknown.
    """
    return f"{mass_kg:.1f} kg" if std_kg is None else f"{mass_kg:.1f} ± {TO_95 * std_kg:.1f} kg"


def lasting(hours: float) -> str:
    """As in "12.3 h", "4.5 min", "18 s" and "0.5 s".

    Args:
        hours: how long.
    """
    seconds = 3600 * hours
    if hours >= 1:
        return f"{hours:.1f} h"
    if seconds >= 60:
        return f"{60 * hours:.1f} min"
    return f"{seconds:.0f} s" if seconds >= 10 or not hours else f"{seconds:.1f} s"
