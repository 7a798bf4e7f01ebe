"""The audit of dependencies says what it found, and does not take silence for a clean bill."""

import importlib.util
import subprocess
import sys

import pytest

from tests.contracts.command import ROOT

FILE = ROOT / "deploy" / "security" / "advisories.py"


@pytest.fixture(scope="module")
def audit():
    spec = importlib.util.spec_from_file_location("advisories", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def package(name, *vulns):
    return {"name": name, "version": "1.0", "vulns": [{"id": one, "fix_versions": ["1.1"]} for one in vulns]}


def test_a_known_advisory_fails_and_is_named(audit):
    code, lines = audit.judge({"dependencies": [package("a"), package("b", "PYSEC-1", "GHSA-2")]})
    assert code == 1
    assert lines == ["b 1.0: PYSEC-1, mended in 1.1", "b 1.0: GHSA-2, mended in 1.1"]


def test_what_the_index_does_not_know_is_not_called_clean(audit):
    code, lines = audit.judge({"dependencies": [package("a"), {"name": "c", "skip_reason": "not found"}]})
    assert code == 0
    assert lines == ["advisories: the index does not know c", "advisories: none is known against 1 pinned packages"]


def test_an_index_that_knows_nothing_is_no_index(audit):
    assert audit.is_alive({"dependencies": [package("starlette", "PYSEC-1")]})
    assert not audit.is_alive({"dependencies": [{"name": "starlette", "skip_reason": "not found"}]})
    assert not audit.is_alive({"error": "no network"})
    assert audit.judge({"error": "no network"}) == (0, ["advisories: not audited: no network"])


def test_without_the_auditor_it_skips_with_a_line(tmp_path):
    (tmp_path / "pins").write_text("# a comment\na==1.0\n")
    done = subprocess.run(
        [sys.executable, FILE, tmp_path / "pins", tmp_path], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0
    assert done.stdout.startswith("advisories: not audited: ")
