"""The front door: help, usage errors, exit codes, and that errors of ours do not show a traceback."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.contracts.command import AXIS, ROOT, complaint, tribowatch, write, write_configuration


def all_commands():
    """Every command and sub-command as typed, from the program itself."""
    import typer.main

    from monitor.cli import app

    found = []
    for name, command in typer.main.get_command(app).commands.items():
        found.append([name])
        found += [[name, inner] for inner in getattr(command, "commands", {})]
    return found


def test_help_names_every_command():
    done = tribowatch("--help")
    assert done.returncode == 0
    minimum = {"demo", "run", "simulate", "identify", "replay", "history", "alerts", "axes", "check-config", "doctor"}
    commands = [words[0] for words in all_commands()]
    assert minimum <= set(commands)
    assert all(name in done.stdout for name in commands)


@pytest.mark.parametrize("words", all_commands(), ids=" ".join)
def test_every_command_and_every_option_explains_itself(words):
    import typer.main

    from monitor.cli import app

    command = typer.main.get_command(app)
    for word in words:
        command = command.commands[word]
    assert command.help
    silent = [one.name for one in command.params if not getattr(one, "help", None)]
    assert not silent, f"without a help text: {silent}"


def test_without_arguments_the_help_is_shown():
    done = tribowatch()
    assert done.returncode == 0
    assert "Usage" in done.stdout


def test_version_is_that_of_the_distribution():
    from importlib.metadata import version

    assert tribowatch("--version").stdout.strip() == f"tribowatch {version('tribowatch')}"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nonsense"], "No such command 'nonsense'"),
        (["--nonsense"], "No such option: --nonsense"),
        (["check-config"], "Missing argument"),
        (["check-config", "--nonsense", "x"], "No such option: --nonsense"),
    ],
)
def test_usage_errors_are_one_line_and_exit_2(arguments, words):
    line = complaint(tribowatch(*arguments), 2)
    assert words in line
    assert "--help" in line


def test_an_error_of_ours_is_one_line_with_the_place_of_its_details():
    """No traceback on the screen; the file has it. The fault: a command that raises what nobody expects."""
    program = """
import monitor.cli
@monitor.cli.app.command("broken")
def broken() -> None:
    raise ZeroDivisionError("for the test")
monitor.cli.main(["broken"])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    line = complaint(done, 1)
    detail = Path(line.rsplit("details in ", 1)[1])
    text = detail.read_text()
    assert "Traceback" in text
    assert "ZeroDivisionError: for the test" in text
    detail.unlink()


def test_check_config_shows_what_the_daemon_would_do(tmp_path):
    config = write_configuration(tmp_path)
    done = tribowatch("check-config", config)
    assert done.returncode == 0, done.stderr
    assert "axis-0001" in done.stdout
    assert "tribowatch/test/axis-0001/samples" in done.stdout


def test_json_of_check_config_is_pure(tmp_path):
    done = tribowatch("check-config", write_configuration(tmp_path), "--json")
    result = json.loads(done.stdout)
    assert result["schema_version"] == 1
    assert result["axes"][0]["moving_mass"]["unit"] == "kg"
    assert result["axes"][0]["moving_mass"]["value"] == pytest.approx(20 + 0.012 / 0.045**2)


def test_missing_configuration(tmp_path):
    line = complaint(tribowatch("check-config", tmp_path / "nowhere.toml"), 2)
    assert "nowhere.toml" in line


def test_configuration_that_is_not_toml(tmp_path):
    path = write(tmp_path / "c.toml", "site = \n")
    line = complaint(tribowatch("check-config", path), 2)
    assert "c.toml" in line
    assert "line 1" in line


def test_unknown_key_of_the_configuration_names_the_nearest(tmp_path):
    line = complaint(tribowatch("check-config", write_configuration(tmp_path, "[window]\nsample = 100\n")), 2)
    assert "window.sample" in line
    assert "'samples'" in line


def test_value_out_of_range_in_the_configuration(tmp_path):
    line = complaint(tribowatch("check-config", write_configuration(tmp_path, "[window]\nsamples = -5\n")), 2)
    assert "window.samples" in line
    assert "-5" in line


def test_unknown_key_of_the_axis_file_names_the_nearest(tmp_path):
    config = write_configuration(tmp_path, axis=AXIS.replace("Rm =", "Rmm ="))
    line = complaint(tribowatch("check-config", config), 2)
    assert "axis.toml" in line
    assert "Rmm" in line
    assert "Rm" in line.replace("Rmm", "")


def test_missing_axis_file(tmp_path):
    config = write_configuration(tmp_path)
    (tmp_path / "axis.toml").unlink()
    assert "axis.toml" in complaint(tribowatch("check-config", config), 2)


def test_text_where_the_axis_file_needs_a_number(tmp_path):
    config = write_configuration(tmp_path, axis=AXIS.replace("M = 20.0", 'M = "heavy"'))
    line = complaint(tribowatch("check-config", config), 2)
    assert "M" in line
    assert "heavy" in line


def test_doctor_without_configuration_looks_at_the_installation():
    done = tribowatch("doctor", "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["verdict"] in ("ok", "warning")
    assert {"installation", "compiled kernels", "clock", "disk"} <= {check["name"] for check in result["checks"]}


def test_doctor_says_that_the_daemon_is_not_running_and_what_to_do(tmp_path):
    done = tribowatch("doctor", "--config", write_configuration(tmp_path), "--json")
    assert done.returncode == 3, done.stderr
    checks = {check["name"]: check for check in json.loads(done.stdout)["checks"]}
    assert checks["axis files"]["outcome"] == checks["workers"]["outcome"] == "ok"
    assert checks["link"]["outcome"] == checks["database"]["outcome"] == "out_of_reach"
    assert "tribowatch run" in checks["link"]["finding"]


def test_doctor_says_that_there_is_no_cluster(tmp_path):
    config = write_configuration(tmp_path)
    config.write_text(config.read_text() + '[identification]\ncluster = "tcp://127.0.0.1:9"\n')
    done = tribowatch("doctor", "--config", config, "--json")
    assert done.returncode == 3, done.stderr
    [finding] = [one["finding"] for one in json.loads(done.stdout)["checks"] if one["name"] == "workers"]
    assert "no Dask scheduler at tcp://127.0.0.1:9" in finding


def test_doctor_names_a_bad_axis_file(tmp_path):
    config = write_configuration(tmp_path, axis=AXIS.replace("M = 20.0", "M = -1.0"))
    done = tribowatch("doctor", "--config", config)
    assert done.returncode == 2
    assert "axis.toml" in done.stdout
    assert "-1" in done.stdout


def test_interrupted_while_it_loads_it_ends_without_a_word():
    """The first second of a command is imports; ^C then is no error of ours to show."""
    program = """
import os, runpy, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Impatient:
    def find_spec(self, name, path=None, target=None):
        if name == "typer":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Impatient())
sys.argv = ["tribowatch", "--version"]
runpy.run_module("monitor", run_name="__main__")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, cwd=ROOT)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
