"""The figures of `scripts/structure.py` against packages whose structure is known."""

import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "scripts" / "structure.py"


@pytest.fixture
def structure(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    spec = importlib.util.spec_from_file_location("structure", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "PACKAGES", ("synthetic_package",))
    monkeypatch.setattr("sys.argv", ["structure.py", "--list"])
    monkeypatch.syspath_prepend(str(tmp_path))
    folder = tmp_path / "synthetic_package"
    folder.mkdir()
    for name, text in {
        "__init__.py": "",
        "short.py": "x = 1\n",
        "long.py": "from synthetic_package import short, one, shared\n" + 500 * "\n",
        "one.py": "from synthetic_package import two, shared\n",
        "two.py": "from synthetic_package import three\n",
        "three.py": "def late():\n    from synthetic_package import one\n",
        "shared.py": "",
        "page.js": 501 * "\n",
    }.items():
        (folder / name).write_text(text)
    return module


def test_short_long_and_circular_modules_are_counted(structure, capsys):
    assert structure.main() == 1
    said = capsys.readouterr().out
    assert "Modules: 6, with one importer: 3\n" in said
    short = "  synthetic_package.short\n  synthetic_package.three\n  synthetic_package.two\n"
    assert f"With one importer and below 70 lines: 3\n{short}" in said
    assert "Python or JavaScript files above 500 lines: 2\n" in said
    circle = "  synthetic_package.one synthetic_package.three synthetic_package.two\n"
    assert f"Circles of imports: 1\n{circle}" in said


@pytest.mark.slow
def test_only_what_is_kept_to_passes(structure):
    folder = structure.ROOT / "synthetic_package"
    circle, long = folder / "three.py", (folder / "long.py", folder / "page.js")
    for file in long:
        file.write_text(file.read_text().rstrip("\n"))
    assert structure.main() == 1  # the circle
    circle.write_text("")
    assert structure.main() == 0
    long[1].write_text(501 * "\n")
    assert structure.main() == 1
    long[1].write_text("")
    for k in range(structure.MOST_SHORT):
        (folder / f"used_once_{k}.py").write_text("")
        with long[0].open("a") as users:
            users.write(f"\nfrom synthetic_package import used_once_{k}")
    assert structure.main() == 1


def test_what_has_a_budget_is_counted_and_may_not_go_beyond_it(structure, capsys, monkeypatch):
    monkeypatch.setitem(structure.MOST, "Names of two files or more", 1)
    folder = structure.ROOT / "synthetic_package"
    (folder / "page.js").unlink()
    (folder / "long.py").write_text("x: dict[str, Any]\n")
    (folder / "three.py").write_text("y = setting(1, 'm')\n")
    (folder / "below").mkdir()
    (folder / "below" / "__init__.py").write_text("")
    (folder / "below" / "two.py").write_text("")
    assert structure.main() == 0
    said = capsys.readouterr().out
    for what, found in {
        "Lines of the product": 5,
        "Settings": 1,
        "Untyped dictionaries": 1,
        "Names of two files or more": 1,
    }.items():
        assert f"{what}: {found} of " in said
        monkeypatch.setitem(structure.MOST, what, found - 1)
        assert structure.main() == 1
        assert f"Beyond its budget: {what}, by 1." in capsys.readouterr().out
        monkeypatch.setitem(structure.MOST, what, found)
    assert structure.main() == 0
