"""One number of a module of the solver at another value, from the moment at which the module is read.

Whatever is made of it there (other constants, defaults, what other modules import) is made of the new value,
which a value that is put into a module later would not give. So it is asked in a process of its own:
`answer_with` calls a function of a benchmark there.
"""

import argparse
import ast
import importlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from itertools import pairwise
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import numpy as np

MODULE = "benchmarks.rewriting"
ROOM = Path(__file__).parents[1] / "solver"
LIMIT_S = 1800.0
KEPT_OF_A_CAUSE = ("readings", "asked_up_to")  # how sizes are told, and up to which


@dataclass(frozen=True)
class Number:
    """A constant at the top of a module, or a setting's default, by its file below `solver`."""

    file: str
    name: str  # of a setting with its class: "TrajectorySettings.mass_std"

    @property
    def called(self) -> str:
        """By file and name, as answers and pages have it."""
        return f"{self.file} {self.name}"

    @property
    def module(self) -> str:
        """As it is imported."""
        return ".".join(["solver", *Path(self.file).with_suffix("").parts])


def scaled(value: Any, factor: float) -> Any:
    """Every number in it times a factor: whole ones stay whole, and at least 1; truths and words stay.

    Of a curve over a share from 0 to 1, at least three pairs of share and value, the shares stay as well.
    """
    match value:
        case tuple() | list() if _is_curve(value):
            return type(value)((share, scaled(one, factor)) for share, one in value)
        case bool() | str() | None:
            return value
        case int():
            return value if value == 0 else int(np.sign(value)) * max(1, round(abs(value) * factor))
        case float() | np.ndarray():
            return value * factor
        case tuple() | list() | set() | frozenset():
            return type(value)(scaled(one, factor) for one in value)
        case dict():
            return {key: scaled(one, factor) for key, one in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        names = [f.name for f in fields(value) if f.init and f.name not in KEPT_OF_A_CAUSE]
        return replace(value, **{name: scaled(getattr(value, name), factor) for name in names})
    return value


def _is_curve(values: Sequence[Any]) -> bool:
    """Whether there are three pairs or more, of which the first numbers grow from 0 and are at most 1."""
    if len(values) < 3 or not all(isinstance(pair, tuple) and len(pair) == 2 for pair in values):
        return False
    return values[0][0] == 0 and all(a[0] < b[0] <= 1 for a, b in pairwise(values))


def set_otherwise(numbers: Sequence[Number], factor: float) -> None:
    """From now on their modules are read with those numbers times the factor.

    Raises:
        RuntimeError: a module has been read already.
    """
    for module in {number.module for number in numbers}:
        if module in sys.modules:
            raise RuntimeError(f"{module} has been read; ask in a process of its own")
    sys.meta_path.insert(0, _Finder(numbers, factor))


class NoAnswerError(Exception):
    """With that value there is none; the message says why."""


def answer_with(
    number: Number | Sequence[Number] | None,
    factor: float,
    function: Callable[..., Any],
    arguments: Mapping[str, Any],
) -> Any:
    """What a function says in a process in which a number, or each of several, is another one.

    Args:
        number: the constant, or several; None: all as usual.
        factor: times its value.
        function: at the top of a module of `benchmarks`.
        arguments: of it, and like its answer such as JSON has them.

    Raises:
        NoAnswerError: it fails, or takes more than half an hour.
        RuntimeError: somebody ended its process, which says nothing of the number.
    """
    command = [
        sys.executable,
        "-m",
        MODULE,
        f"{_module_of(function)}:{function.__name__}",
        json.dumps(arguments),
    ]
    for one in (number,) if isinstance(number, Number) else number or ():
        command += ["--number", one.file, one.name, "--factor", str(factor)]
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as errors:
        try:
            done = subprocess.run(
                command, stdout=subprocess.PIPE, stderr=errors, text=True, timeout=LIMIT_S, check=False
            )
        except subprocess.TimeoutExpired as error:
            raise NoAnswerError(f"it takes more than {LIMIT_S:.0f} s") from error
        if done.returncode < 0:
            raise RuntimeError(f"the process was ended from outside (signal {-done.returncode})")
        if done.returncode:
            errors.seek(0)
            raise NoAnswerError((errors.read().strip().splitlines() or ["it ended"])[-1])
    return json.loads(done.stdout.splitlines()[-1])


def _module_of(function: Callable[..., Any]) -> str:
    run_as_a_script = sys.modules["__main__"].__spec__ if function.__module__ == "__main__" else None
    return run_as_a_script.name if run_as_a_script else function.__module__


class _Finder:
    def __init__(self, numbers: Sequence[Number], factor: float) -> None:
        self.numbers, self.factor = numbers, factor

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        numbers = [number for number in self.numbers if number.module == fullname]
        if not numbers:
            return None
        file = str(ROOM / numbers[0].file)
        return spec_from_file_location(fullname, file, loader=_Loader(fullname, file, numbers, self.factor))


class _Loader(SourceFileLoader):
    def __init__(self, fullname: str, path: str, numbers: Sequence[Number], factor: float) -> None:
        super().__init__(fullname, path)
        self.numbers, self.factor = numbers, factor

    def get_code(self, fullname: str) -> CodeType:
        """Never from the cache, and never into it."""
        tree = ast.parse(self.get_data(self.path), self.path)
        for number in self.numbers:
            kind, _, name = number.name.rpartition(".")
            within = [node.body for node in tree.body if isinstance(node, ast.ClassDef) and node.name == kind]
            if not any(_scales(node, name, self.factor) for node in (within[0] if within else tree.body)):
                raise RuntimeError(f"{number.file} has no {number.name}")
        return compile(ast.fix_missing_locations(tree), self.path, "exec", dont_inherit=True)


def _times(factor: float, value: ast.expr) -> ast.expr:
    call = ast.parse(f"__import__({MODULE!r}, fromlist=['scaled']).scaled(0, {factor!r})", mode="eval").body
    assert isinstance(call, ast.Call)
    call.args[0] = value
    return ast.copy_location(call, value)


def _scales(node: ast.stmt, name: str, factor: float) -> bool:
    """Whether a statement gives the name its value; then that is changed in it."""
    if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
        return False
    for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
        match target, node.value:
            case ast.Name(id=found), ast.Call(func=ast.Name(id="setting"), args=[default, *others]) if (
                found == name
            ):
                node.value.args = [_times(factor, default), *others]
                return True
            case ast.Name(id=found), _ if found == name:
                node.value = _times(factor, node.value)
                return True
            case ast.Tuple(elts=names), ast.Tuple(elts=values) if len(names) == len(values):
                for k, one in enumerate(names):
                    if isinstance(one, ast.Name) and one.id == name:
                        values[k] = _times(factor, values[k])
                        return True
    return False


def main() -> None:
    """Be the process of `answer_with`."""
    parser = argparse.ArgumentParser(prog=f"python -m {MODULE}", description=__doc__)
    parser.add_argument("function")
    parser.add_argument("arguments")
    parser.add_argument("--number", nargs=2, action="append", default=[])
    parser.add_argument("--factor", type=float, default=1.0)
    given = parser.parse_args()
    if given.number:
        set_otherwise([Number(*one) for one in given.number], given.factor)
    module, _, name = given.function.partition(":")
    function = getattr(importlib.import_module(module), name)
    print(json.dumps(function(**json.loads(given.arguments))))


if __name__ == "__main__":
    main()
