"""What is judged, as hashes: all code of the engine, and the thresholds it decides by."""

from __future__ import annotations

import ast
import hashlib
from pathlib import Path

from tests.blind.diagnosing import ROOT


def engine() -> str:
    """Hash of the code that is judged: all of plant/ and identify/."""
    found = hashlib.sha256()
    for path in sorted(path for room in ("plant", "identify") for path in (ROOT / room).rglob("*.py")):
        found.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return found.hexdigest()[:16]


def thresholds(folder: Path = ROOT / "identify" / "mismatch") -> dict[str, str]:
    """Every constant of the diagnosis that is a number, or numbers: file.NAME -> value as written."""
    found = {}
    for path in sorted(folder.glob("*.py")):
        for statement in ast.parse(path.read_text(encoding="utf-8")).body:
            targets = statement.targets if isinstance(statement, ast.Assign) else []
            for target in targets:
                pairs = [(target, statement.value)]  # type: ignore[attr-defined]
                if isinstance(target, ast.Tuple) and isinstance(statement.value, ast.Tuple):  # type: ignore[attr-defined]
                    pairs = list(zip(target.elts, statement.value.elts, strict=True))  # type: ignore[attr-defined]
                for name, value in pairs:
                    if isinstance(name, ast.Name) and name.id.isupper() and _numeric(value):
                        found[f"{path.stem}.{name.id}"] = ast.unparse(value)
    return found


def _numeric(value: ast.expr) -> bool:
    """Whether an expression holds numbers and no text."""
    constants = [node.value for node in ast.walk(value) if isinstance(node, ast.Constant)]
    return bool(constants) and all(isinstance(one, (int, float)) and not isinstance(one, bool) for one in constants)


def digest() -> str:
    """Hash of all thresholds."""
    lines = "\n".join(f"{name} = {value}" for name, value in sorted(thresholds().items()))
    return hashlib.sha256(lines.encode()).hexdigest()[:16]
