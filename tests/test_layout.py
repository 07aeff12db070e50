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
#: From the ground up; a module may import from the rows above its own here.
LAYERS = [
    {"errors", "_version"},
    {
        "files",
        "pixels",
        "color",
        "landmarks",
        "grid",
        "jit",
        "threads",
        "memo",
        "timing",
        "studio_lights",
        "declared",
        "radial_basis",
    },
    {"options", "views", "guided", "skin", "compose", "graph", "rbf", "saddle_point"},
    {"settings_file", "_photo", "profile", "_landmark_lines", "face_models", "sweeps", "warm_start"},
    {"image", "_landmark_trees", "search_forest"},
    {"landmark_files", "detect", "mincut", "primal_dual"},
    {"level_sets"},
    {"certificate", "alignment", "ltv"},
    {"planes", "scale", "lambertian", "membrane", "control"},
    {"face_shape", "matting", "blending"},
    {"rendering", "methods"},
    {"results", "inputs", "image_kinds", "random_settings"},
    {"relighting", "reference_pool"},
    {"augment"},
    {"figures", "samples", "terminal", "cli_options", "yale_b", "scores"},
    {"cases"},
    {"evaluation"},
    {"evaluation_figure"},
    {"studio", "batch"},
    {"cli_progress"},
    {"cli_batch", "cli_evaluate", "cli_split", "cli_transfer", "cli_studio"},
    {"cli"},
]
MODULES = sorted(
    ".".join(path.relative_to(SOURCE).with_suffix("").parts)
    for path in SOURCE.rglob("*.py")
    if path != SOURCE / "__init__.py"
)


def layer_of(module):
    return next(level for level, names in enumerate(LAYERS) if module.split(".")[0] in names)


def imports_of(module):
    tree = ast.parse((SOURCE / Path(*module.split("."))).with_suffix(".py").read_text("utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative imports hide where things come from"
            if node.module == "relit":
                yield from (f"relit.{name.name}" for name in node.names if name.name in MODULES)
            else:
                yield node.module


@pytest.mark.parametrize("module", MODULES)
def test_no_import_points_up(module):
    for imported in imports_of(module):
        if imported.startswith("relit."):
            other = imported.removeprefix("relit.")
            same_room = module.split(".")[0] == other.split(".")[0]
            assert same_room or layer_of(other) < layer_of(module), f"{module} imports {other}"


@pytest.mark.parametrize(
    ("library", "room"),
    [
        ("ai_edge_litert", {"face_models"}),
        (
            "click",
            {"cli", "cli_batch", "cli_evaluate", "cli_split", "cli_transfer", "cli_studio"}
            | {"cli_options", "cli_progress", "terminal"},
        ),
        ("rich", {"cli_progress", "terminal"}),
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
        text = (SOURCE / Path(*module.split("."))).with_suffix(".py").read_text("utf-8")
        calls = {
            node.func.id
            for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        assert "print" not in calls, module


def test_contributing_names_every_module():
    text = (SOURCE.parents[1] / "CONTRIBUTING.md").read_text("utf-8")
    named = set(re.findall(r"`(\w+)/?`", text))
    public = {module.split(".")[0] for module in MODULES}
    assert public <= named, public - named


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

    trees = {
        module: ast.parse((SOURCE / Path(*module.split("."))).with_suffix(".py").read_text("utf-8"))
        for module in MODULES
    }
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
