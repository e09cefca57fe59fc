"""The figures of `scripts/constants.py` against a made-up room; and its register is up to date."""

import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "scripts" / "constants.py"
MODULE = """
GRAVITY = 9.8
WORDS, YES = "no number", True
FIRST, SECOND = 1, 2
WELL, IDLE = 1.0, 2.0
TABLE: dict[str, float] = {"a": 1.0}
NEW = -3

def inside():
    LOCAL = 4
    return LOCAL

class OneSettings:
    judged: float = setting(0.5, unit="m", why="half of what benchmarks/PAGE.md shows, "
        "and more")
    lonely: float = setting(0.5, unit="m", why="about a foot's length")
    named: str = setting("word", unit="", why="benchmarks/PAGE.md")
    shown: float = setting(2.0, unit="", why="chosen by halves")
    invented: float = setting(2.0, unit="", why="benchmarks/NONE.md")
    best: float = setting(2.0, unit="", why="varied")
    idle: float = setting(2.0, unit="", why="varied")
    doubted: float = setting(2.0, unit="", why="varied")
    unsure: float = setting(2.0, unit="", why="varied")
    elsewhere: float = setting(2.0, unit="", why="varied, and asks for a look on another page")
"""
SETTINGS_PAGE = """
## Decides nothing here: 1
| `one.idle` | `OneSettings.idle` | x |
| `one.elsewhere` | `OneSettings.elsewhere` | x |
## Stands: 1
| `one.best` | `OneSettings.best` | x |
## May be chance: 1
| `one.unsure` | `OneSettings.unsure` | x |
## Asks for a look: 1
| `one.doubted` | `OneSettings.doubted` | x |
"""
OTHER_PAGE = """
## Decides nothing here: 1
| `one.best` | `OneSettings.best` | x |
## Asks for a look: 1
| `one.elsewhere` | `OneSettings.elsewhere` | x |
"""
CONSTANTS_PAGE = """
## Decides nothing here: 2
| `part/module.py` | `IDLE` | x |
| `other/module.py` | `SECOND` | x |
## Stands: 1
| `part/module.py` | `WELL` | x |
"""
REGISTER = """
["part/module.py"]
physical = ["GRAVITY"]
numerical = ["FIRST"]
tuned = ["SECOND", "TABLE", "WELL", "IDLE"]
[support]
"part/module.py OneSettings.shown" = "benchmarks/PAGE.md: twice as good"
"""


@pytest.fixture
def constants():
    spec = importlib.util.spec_from_file_location("constants", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def made_up(constants, tmp_path, monkeypatch):
    monkeypatch.setattr(constants, "ROOT", tmp_path)
    for place, text in {
        "solver/part/module.py": MODULE,
        "scripts/constants.toml": REGISTER,
        "benchmarks/PAGE.md": "It is twice as good.",
        "benchmarks/SETTINGS.md": SETTINGS_PAGE,
        "benchmarks/GAIT_SETTINGS.md": OTHER_PAGE,
        "benchmarks/DIAGNOSIS_CONSTANTS.md": CONSTANTS_PAGE,
    }.items():
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).write_text(text)
    return constants


def kinds(constants):
    known = constants.register()
    return {constant.name: constants.kind_of(constant, known) for constant in constants.constants()}


def test_each_name_with_a_number_has_its_kind(made_up):
    assert kinds(made_up) == {
        "GRAVITY": "physical",
        "FIRST": "numerical",
        "SECOND": "tuned, unsupported",
        "TABLE": "tuned, unsupported",
        "WELL": "tuned, supported",
        "IDLE": "tuned, no effect",
        "NEW": "not sorted",
        "OneSettings.judged": "tuned, supported",
        "OneSettings.lonely": "tuned, unsupported",
        "OneSettings.shown": "tuned, supported",
        "OneSettings.invented": "tuned, unsupported",
        "OneSettings.best": "tuned, supported",
        "OneSettings.idle": "tuned, no effect",
        "OneSettings.doubted": "tuned, unsupported",
        "OneSettings.unsure": "tuned, by chance",
        "OneSettings.elsewhere": "tuned, unsupported",
    }


def test_they_are_counted_by_package(made_up, capsys):
    made_up.print_figures(listed=True)
    said = capsys.readouterr().out
    (row,) = (line.split() for line in said.splitlines() if line.startswith("  part "))
    assert row == ["part", "1", "1", "4", "2", "1", "6", "1"]
    assert "not sorted:\n  part/module.py NEW\n" in said


def test_what_the_register_says_and_is_not_so_is_told(made_up, tmp_path):
    assert made_up.stale(made_up.register()) == []
    (tmp_path / "benchmarks/PAGE.md").write_text("It is as good.")
    (tmp_path / "solver/part/module.py").write_text(MODULE.replace("GRAVITY", "G"))
    gone, unsaid = made_up.stale(made_up.register())
    assert gone == "part/module.py GRAVITY is gone"
    assert "'twice as good' does not stand in benchmarks/PAGE.md" in unsaid


def test_the_register_is_up_to_date(constants):
    assert constants.stale(constants.register()) == []
