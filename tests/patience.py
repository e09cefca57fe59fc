"""How long tests wait for what has to happen: only a hang exhausts it, however busy the machine."""

PATIENCE_S = 300.0
PATIENCE_MS = 1000.0 * PATIENCE_S
FOR_EVER_S = 2.0 * PATIENCE_S  # that a program sleeps whose end is waited for: it outlasts the patience
