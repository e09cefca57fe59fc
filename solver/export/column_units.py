"""Units at the ends of columns' names: of a coordinate's value, and of its generalized force."""

UNITS = {"rotation": ("rad", "moment_Nm"), "translation": ("m", "force_N")}
POWER = "power_W"
