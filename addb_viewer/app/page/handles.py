"""Setting what the page shows."""

from typing import Any

import viser


def put(handle: viser.GuiInputHandle[Any], value: object) -> None:
    """Show a value that the app found, not a person; nothing is sent where it is shown already."""
    if handle.value != value:
        handle.value = value  # type: ignore[misc]
