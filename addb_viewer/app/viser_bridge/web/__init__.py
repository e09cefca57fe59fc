"""What our page knows of the inside of viser's."""
