"""Where compiled code is kept: as told, else beside the code, else with the user, else for this run only and loudly."""

import os
import subprocess
import sys
import warnings

import pytest

from plant.kernels import cache_files


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """No folder given; the code's own and the user's are in a fresh place."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    monkeypatch.setattr(cache_files, "PLANT", tmp_path / "code")
    return tmp_path


def block(path):
    """A file where a folder is wanted: not writable even for root."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("in the way")


def test_the_environment_is_obeyed(nowhere, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(nowhere / "told"))
    assert cache_files.cache_folder().parent == nowhere / "told"


def test_without_it_compiled_code_lies_beside_the_code(nowhere):
    assert cache_files.cache_folder().parent == nowhere / "code" / "kernels" / "__pycache__"


def test_read_only_code_falls_back_to_the_users_cache(nowhere):
    block(nowhere / "code" / "kernels")
    assert cache_files.cache_folder().parent == nowhere / "user" / "tribowatch"


def test_when_nothing_can_be_written_it_says_so_and_still_works(nowhere):
    block(nowhere / "code" / "kernels")
    block(nowhere / "user")
    with pytest.warns(RuntimeWarning, match="cannot write compiled code to .*set NUMBA_CACHE_DIR"):
        folder = cache_files.cache_folder()
    assert folder.is_dir()


def test_changed_sources_never_meet_old_machine_code(nowhere):
    source = nowhere / "code" / "kernels" / "step.py"
    source.parent.mkdir(parents=True)
    source.write_text("one")
    before = cache_files.cache_folder()
    source.write_text("two")
    assert cache_files.cache_folder() != before


def test_a_second_process_loads_what_the_first_compiled(tmp_path):
    script = (
        "import sys, plant.kernels.exponential as e, numba, time\n"
        "from plant.effects import find\n"
        "from plant.kernels.laws import Law\n"
        "law = find('rail_defect').laws[0]\n"
        "assert law.address\n"
        "print(sum(law._compiled.cache_hits.values()) if hasattr(law._compiled.cache_hits, 'values')"
        " else law._compiled.cache_hits)\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    hits = [
        int(subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, check=True).stdout)
        for _ in range(2)
    ]
    assert hits == [0, 1]


def test_importing_names_and_units_does_not_start_the_compiler():
    script = "import sys, plant, plant.effects; plant.effects.names(); print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_no_warning_in_an_ordinary_start(nowhere):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cache_files.cache_folder()
