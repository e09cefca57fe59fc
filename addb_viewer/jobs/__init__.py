"""What can be done to a subject, once: the shell, the app and the Python interface call it."""
