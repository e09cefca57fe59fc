"""The search for causes of a wrench balance that does not close."""
