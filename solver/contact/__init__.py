"""Which foot stands on which plate, and when."""
