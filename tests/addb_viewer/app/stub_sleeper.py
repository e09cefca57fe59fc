"""Stands for work that takes long."""

import time

from tests.patience import FOR_EVER_S

if __name__ == "__main__":
    time.sleep(FOR_EVER_S)
