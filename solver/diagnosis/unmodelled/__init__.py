"""What no cause of the catalogue explains."""
