"""Terms of the trajectory fit, one a file; `term.py` says what each of them gives."""
