"""The house's plan, held over the syntax trees: imports run downward, heavy libraries stay at the edge."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = "tendonrod"
SOURCE = Path(__file__).parents[1] / "src" / PACKAGE

# From the ground up. A module may import from its own floor and the floors below, never from above.
# A package (statics, motion, ...) stands on one floor as a whole. A new module must be given its floor here.
FLOORS = [
    {"errors", "files"},
    {"rotation", "curve"},
    {"section", "body", "tendon", "surface"},
    {"anatomy"},
    {
        "parameters",
        "robot",
        "robotfile",
        "robotfile_tables",
        "robotfile_words",
        "robotfile_writing",
        "loads",
        "scenefile",
        "scenefile_writing",
    },
    {"device", "device_solid"},
    {"statics"},
    {"motion"},
    {"measurement"},
    {"rig"},
    {"navigate"},
    {"plot", "device_figure", "section_figure"},
    {"report", "reproduce"},
    {"cli"},
]
FLOOR_OF = {name: floor for floor, names in enumerate(FLOORS) for name in names}
FRONT_DOORS = {"__init__", "__main__"}

# Libraries that cost start-up time are imported where they are used, inside functions; the exceptions by module.
HEAVY = {
    *("numba", "scipy", "pandas", "xarray", "pydantic"),
    *("serial", "ndicapy", "pyigtl", "control", "h5py", "h5netcdf"),
    *("matplotlib", "typer", "rich", "jinja2", "trimesh", "manifold3d", "ezdxf"),
    *("fastapi", "uvicorn", "starlette", "websockets", "playwright"),
}
EXCEPTIONS = {
    "cli": {"typer"},
    "measurement": {"pydantic"},
    **{name: {"pydantic"} for name in ("robotfile", "robotfile_tables", "scenefile")},
}
# The modules that serve the page, which nothing imports until it is served.
WEB = tuple(f"navigate/{name}" for name in ("messages", "asked", "told", "hub", "routes", "server"))
KERNELS = ("statics/kernel", "anatomy/kernel")  # and every module whose name starts so: numba
NOT_IN_KERNEL = {"scipy", "matplotlib", PACKAGE}

MODULES = sorted(path.relative_to(SOURCE) for path in SOURCE.rglob("*.py"))
each_module = pytest.mark.parametrize("module", MODULES, ids=lambda path: path.as_posix())


def imported_names(node: ast.AST, module: Path) -> Iterator[str]:
    """Absolute dotted names that one import statement brings in."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and node.level == 0:
        yield from (f"{node.module}.{alias.name}" for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        package = [PACKAGE, *module.parent.parts]
        base = package[: len(package) - node.level + 1] + (node.module.split(".") if node.module else [])
        yield from (".".join([*base, alias.name]) for alias in node.names)


def all_imports(module: Path) -> set[str]:
    """Everything that a module imports anywhere, inside functions too."""
    tree = ast.parse((SOURCE / module).read_text(encoding="utf-8"))
    return {name for node in ast.walk(tree) for name in imported_names(node, module)}


def imports_when_imported(module: Path) -> set[str]:
    """What a module imports when it is itself imported: not inside functions, not for type checkers only."""

    def visit(node: ast.AST) -> Iterator[str]:
        yield from imported_names(node, module)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            return
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            return
        for child in ast.iter_child_nodes(node):
            yield from visit(child)

    return set(visit(ast.parse((SOURCE / module).read_text(encoding="utf-8"))))


def floor_name(module: Path) -> str:
    return module.parts[0].removesuffix(".py")


@each_module
def test_every_module_has_a_floor(module: Path):
    assert floor_name(module) in FLOOR_OF.keys() | FRONT_DOORS, f"give {module} a floor in {__file__}"


@each_module
def test_imports_run_downward(module: Path):
    own = floor_name(module)
    if own in FRONT_DOORS:
        return
    inside = {name.split(".")[1] for name in all_imports(module) if name.startswith(f"{PACKAGE}.")}
    above = sorted(name for name in inside if FLOOR_OF.get(name, -1) > FLOOR_OF.get(own, -1))
    assert not above, f"{module} imports from above: {', '.join(above)}"


@each_module
def test_heavy_libraries_are_imported_where_used(module: Path):
    own = module.with_suffix("").as_posix()
    allowed = {"numba"} if own.startswith(KERNELS) else EXCEPTIONS.get(floor_name(module), set())
    if own.startswith(WEB):
        allowed = {"pydantic", "fastapi", "starlette", "uvicorn"}
    misplaced = {name.partition(".")[0] for name in imports_when_imported(module)} & HEAVY - allowed
    assert not misplaced, f"{module} imports {', '.join(sorted(misplaced))} at module level"


def test_pydantic_reads_files_and_messages_and_nothing_else():
    users = {module.as_posix() for module in MODULES if any(n.startswith("pydantic") for n in all_imports(module))}
    users = {user for user in users if not user.startswith(WEB)}
    assert users <= {"robotfile.py", "robotfile_tables.py", "scenefile.py", "measurement/columnmap.py"}


@pytest.mark.parametrize("module", [m for m in MODULES if m.as_posix().startswith(KERNELS)], ids=str)
def test_kernel_knows_arrays_only(module: Path):
    """The compiled kernel imports neither the domain types nor a solver library; kernels may share code."""
    foreign = {
        name
        for name in all_imports(module)
        if name.partition(".")[0] in NOT_IN_KERNEL and not name.startswith(f"{PACKAGE}.statics.kernel")
    }
    assert not foreign


def test_import_of_the_package_stays_light():
    """Numba, SciPy and the edge's libraries are loaded at first use, in a process of its own to be sure."""
    report = f"import sys, {PACKAGE}; print(*(m for m in {sorted(HEAVY)!r} if m in sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", report], capture_output=True, text=True, check=True).stdout.split()
    assert not loaded, f"import {PACKAGE} loads {', '.join(loaded)}"
