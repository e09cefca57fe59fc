"""A video of the recording beside the scene."""
