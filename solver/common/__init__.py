"""What every package of the solver uses."""
