"""From one file format to another: recordings, models and motions, without a fit."""
