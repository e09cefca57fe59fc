"""Linear algebra on one thread: blocks as small as ours lose more by being shared out than they gain."""

from contextlib import AbstractContextManager
from functools import cache

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[object]:
    """In a `with`: libraries of linear algebra use one thread."""
    return _controller().limit(limits=1)


@cache
def _controller() -> ThreadpoolController:
    """Of the libraries that are loaded; looking for them takes 7 ms."""
    return ThreadpoolController()
