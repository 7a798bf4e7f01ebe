"""Data and imports flow one way, I/O libraries stay in the files named for them, and start-up is light."""

import ast
import itertools
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("plant", "identify", "monitor")

# library -> the files that may import it, beside those called *_<library>.py: their names say that they are the edge
EDGES = {
    "zenoh": {
        "plant/zenoh_session.py",
        "plant/publisher.py",
        "plant/acknowledgement.py",
        "plant/replay.py",
    },
    "sqlalchemy": {
        "monitor/models.py",
        "monitor/models_life.py",
        "monitor/database.py",
        "monitor/schema.py",
        "monitor/store.py",
        "monitor/queries.py",
        "monitor/query_rows.py",
        "monitor/http_status.py",
    },
    "alembic": {"monitor/schema.py", "monitor/database.py"},
    "can": set(),
    "cantools": set(),
    "starlette": set(),
    "uvicorn": set(),
    "prometheus_client": set(),
}
DATABASE = ("monitor/migrations/", "monitor/store_", "monitor/query_")
FAMILIES = {
    **dict.fromkeys(EDGES, DATABASE),
    **dict.fromkeys(("starlette", "uvicorn", "prometheus_client"), ("monitor/http_",)),
}


def sources():
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def imported_packages(path: Path) -> set[str]:
    """Top names imported anywhere in the file, also inside functions; not those for type checking alone."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    only_types = {
        id(node)
        for block in ast.walk(tree)
        if isinstance(block, ast.If) and "TYPE_CHECKING" in ast.unparse(block.test)
        for node in ast.walk(block)
    }
    names = set()
    for node in ast.walk(tree):
        if id(node) in only_types:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("library", sorted(EDGES))
def test_only_edge_files_import(library):
    allowed = EDGES[library]
    users = {str(path.relative_to(ROOT)) for path in sources() if library in imported_packages(path)}
    strangers = {
        user
        for user in users - allowed
        if not user.endswith(f"_{library}.py") and not user.startswith(FAMILIES[library])
    }
    assert not strangers, f"{library} is imported outside its edge files"


@pytest.mark.parametrize(("package", "forbidden"), [("plant", {"identify", "monitor"}), ("identify", {"monitor"})])
def test_imports_flow_one_way(package, forbidden):
    found = {
        (str(path.relative_to(ROOT)), name)
        for path in sources()
        if path.is_relative_to(ROOT / package)
        for name in imported_packages(path) & forbidden
    }
    assert not found


def requirements(lines) -> set[str]:
    """Names as they are imported."""
    import_names = {
        "eclipse-zenoh": "zenoh",
        "pydantic-settings": "pydantic_settings",
        "python-can": "can",
        "prometheus-client": "prometheus_client",
    }
    names = {re.match(r"[A-Za-z0-9._-]+", line).group().lower() for line in lines}
    return {import_names.get(name, name) for name in names}


def test_the_list_of_dependencies_is_honest():
    """What is listed is imported, and what is imported is listed."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    used = set().union(*(imported_packages(path) for path in sources()))
    brought = {"llvmlite"}  # numba brings the one version that fits it
    foreign = used - set(sys.stdlib_module_names) - set(PACKAGES) - brought
    core = requirements(project["dependencies"])
    extras = requirements(
        line for name in ("parquet", "postgres", "cluster") for line in project["optional-dependencies"][name]
    )
    assert core <= used, "listed, not imported"
    assert foreign <= core | extras, "imported, not listed"


def test_every_installed_package_is_pinned_and_no_index_is_named():
    pins = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[0-9][A-Za-z0-9.!+]*", pin) for pin in pins)
    pinned = {re.sub(r"[-_.]+", "-", pin.split("==")[0]).lower() for pin in pins}
    missing = {name for name in required_distributions() if name not in pinned}
    assert not missing


def required_distributions() -> set[str]:
    """Everything that installing tribowatch[dev] brings, by normalised name."""
    from importlib.metadata import requires

    from packaging.requirements import Requirement

    found: set[tuple[str, str]] = set()

    def walk(text: str, extra: str) -> None:
        requirement = Requirement(text)
        if requirement.marker and not requirement.marker.evaluate({"extra": extra}):
            return
        for asked in ("", *requirement.extras):
            key = re.sub(r"[-_.]+", "-", requirement.name).lower(), asked
            if key not in found:
                found.add(key)
                for line in requires(requirement.name) or []:
                    walk(line, asked)

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    for line in itertools.chain(project["dependencies"], extras["parquet"], extras["dev"]):
        if not line.startswith("tribowatch"):
            walk(line, "")
    return {name for name, _ in found}


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["identify", "--help"], ["run", "--help"]])
def test_help_starts_without_heavy_libraries(arguments):
    """Help is there at once: no compiler, no transport, no database, no numerics is loaded for it."""
    program = f"""
import json, sys
import monitor.cli
try:
    monitor.cli.main({arguments!r})
except SystemExit as stop:
    code = stop.code
heavy = ["numba", "zenoh", "sqlalchemy", "scipy", "numpy", "pydantic_settings", "plotly", "structlog"]
print(json.dumps([code, [name for name in heavy if name in sys.modules]]), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, timeout=60)
    assert json.loads(done.stderr.splitlines()[-1]) == [0, []], done.stderr
    assert done.stdout.strip()


def test_import_contracts_of_the_linter_hold(tmp_path):
    done = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--cache-dir", tmp_path],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout
