"""What weighs a kilogram: the standard acceleration of free fall, for laboratories that state no other."""

GRAVITY = 9.80665  # [m/s²] CGPM 1901; over the earth it is 9.78 to 9.83
