"""The house: which module may know which, and what the public names are."""

import ast
import importlib
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

import relit

SOURCE = Path(relit.__file__).parent
HOUSE = Path(__file__).parents[1] / "CONTRIBUTING.md"


def modules():
    """Return dotted names under `relit`; a package's own file counts as the last module of its room."""
    for path in sorted(SOURCE.rglob("*.py")):
        yield ".".join(path.relative_to(SOURCE).with_suffix("").parts)


MODULES = [name for name in modules() if name != "__init__"]


def floors():
    """Return the house as CONTRIBUTING prints it: (row, place in the row) of every module and folder."""
    rows = re.findall(r"^\| (top|`\w+/`) \| (.+?) \|", HOUSE.read_text("utf-8"), re.MULTILINE)
    found = {}
    for row, (room, names) in enumerate(rows):
        inside = "" if room == "top" else room.strip("`/") + "."
        for place, name in enumerate(re.findall(r"`(\w+)/?`", names)):
            assert inside + name not in found, f"{inside + name} is in the table twice"
            found[inside + name] = row, place
        if inside:
            found[inside + "__init__"] = row, len(found)
    return found


FLOORS = floors()


def floor_of(module):
    """Return where a module is; of a folder within a room, where that folder is."""
    first, *rest = module.split(".")
    return FLOORS[".".join([first, *rest[:1]])]


def file_of(module):
    return (SOURCE / Path(*module.split("."))).with_suffix(".py")


def imports_of(module):
    for node in ast.walk(ast.parse(file_of(module).read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative imports hide where things come from"
            base = node.module.removeprefix("relit").lstrip(".")
            for name in node.names if node.module.split(".")[0] == "relit" else ():
                full = f"{base}.{name.name}".lstrip(".")
                if full in MODULES:
                    yield f"relit.{full}"
                elif f"{base}.__init__" in MODULES:
                    yield f"relit.{base}.__init__"
                elif base:
                    yield f"relit.{base}"
            if node.module.split(".")[0] != "relit":
                yield node.module


def test_the_table_names_every_module_and_nothing_else():
    within = {".".join(module.split(".")[:2]) for module in MODULES}
    assert within == set(FLOORS)


@pytest.mark.parametrize("module", MODULES)
def test_no_import_points_up(module):
    for imported in imports_of(module):
        if imported.startswith("relit."):
            other = imported.removeprefix("relit.")
            same_folder = module.count(".") == 2 and module.rsplit(".", 1)[0] == other.rsplit(".", 1)[0]
            assert same_folder or floor_of(other) < floor_of(module), f"{module} imports {other}"


@pytest.mark.parametrize(
    ("library", "room"),
    [
        ("ai_edge_litert", {"face"}),
        ("click", {"cli"}),
        ("rich", {"cli"}),
        ("fastapi", {"studio"}),
        ("uvicorn", {"studio"}),
    ],
)
def test_some_libraries_belong_to_one_room(library, room):
    users = {
        module.split(".")[0]
        for module in MODULES
        for name in imports_of(module)
        if name.split(".")[0] == library
    }
    assert users == room


def test_only_the_command_line_prints():
    for module in MODULES:
        text = file_of(module).read_text("utf-8")
        calls = {
            node.func.id
            for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        assert "print" not in calls, module


def test_public_names_are_what_they_say():
    for module in MODULES:
        importlib.import_module(f"relit.{module}")
    assert relit.__all__ == sorted(relit.__all__) == sorted(relit._HOME) == dir(relit)
    for name in relit.__all__:
        thing = getattr(relit, name)
        assert not isinstance(thing, types.ModuleType), f"relit.{name} is hidden by a module"
        assert thing.__module__ == f"relit.{relit._HOME[name]}"
        assert thing.__doc__
    with pytest.raises(AttributeError, match="nonsense"):
        _ = relit.nonsense


@pytest.mark.parametrize("name", [name for name in relit.__all__ if name.islower() or "_" in name])
def test_public_functions_are_documented_in_full(name):
    text = getattr(relit, name).__doc__
    for section in ("Parameters\n", "Raises\n"):
        assert section in text, section
    if name != "detect_faces":
        assert ">>> " in text


def test_importing_relit_brings_no_heavy_library():
    heavy = {"numba", "scipy", "PIL", "ai_edge_litert", "click"}
    code = f"import sys, relit; print(sorted({heavy} & set(sys.modules)))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


def test_version_is_the_packages():
    from importlib.metadata import version

    assert version("relit") == relit.__version__


def test_no_compiled_function_calls_one_of_another_module():
    """numba's cache would go on with the old one after a change of that module."""

    def compiled_in(tree):
        return [
            node
            for node in tree.body
            if isinstance(node, ast.FunctionDef)
            and any(isinstance(d, ast.Name) and d.id in {"compiled", "inlined"} for d in node.decorator_list)
        ]

    trees = {module: ast.parse(file_of(module).read_text("utf-8")) for module in MODULES}
    everywhere = {function.name: module for module, tree in trees.items() for function in compiled_in(tree)}
    assert len(everywhere) > 20
    for module, tree in trees.items():
        own = {function.name for function in compiled_in(tree)}
        for function in compiled_in(tree):
            called = {
                n.func.id
                for n in ast.walk(function)
                if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)
            }
            assert not (called - own) & set(everywhere), f"{module}.{function.name}"
