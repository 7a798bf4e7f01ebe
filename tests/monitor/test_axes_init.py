"""`axes init` and `axes check`: from a foreign recording to a checked axis file, by guesses, options or questions."""

import dataclasses
import io
import json
import threading
import time

import numpy as np
import pytest

from identify.audit_fit import fit
from monitor.axis_guess import guess_columns, guess_constants
from monitor.axis_wizard import first_questions, name_from, questions, read_factors, read_pairs
from monitor.cli.app import run_command
from monitor.listen_zenoh import Heard, as_recording
from plant.axis import Axis, Mechanics, Orientation
from plant.axis_file import read_axis, write_axis
from plant.blocks import recording_blocks
from plant.csv_files import write_csv
from plant.errors import InputError
from plant.publisher import SamplePublisher
from plant.recording_files import write_recording
from plant.zenoh_session import open_session
from tests.identify.healthy_axes import healthy_axes


@pytest.fixture(scope="module")
def machines():
    return healthy_axes(40, seed=3)


def of_kind(machines, orientation):
    return next(m for m in machines if m.axis.mechanics.orientation is orientation)


def run(*arguments):
    return run_command([str(argument) for argument in arguments])


@pytest.mark.parametrize(
    ("names", "columns", "scale"),
    [
        (["t", "torque", "position"], {"t": "t", "position": "position", "torque": "torque"}, {}),
        (
            ["t_s", "position_m", "position_ref_m", "control_V", "force_N"],
            {"t": "t_s", "position": "position_m", "force": "force_N"},
            {},
        ),
        (
            ["Time_ms", "ActualPosition_mm", "Torque_mNm", "SetPosition_mm"],
            {"t": "Time_ms", "position": "ActualPosition_mm", "torque": "Torque_mNm"},
            {"t": 1e-3, "position": 1e-3, "torque": 1e-3},
        ),
        (
            ["run", "t_s", "angle_deg", "torque_cmd", "torque_feedback_Nm", "speed", "drive_temp_C"],
            {
                "t": "t_s",
                "position": "angle_deg",
                "torque": "torque_feedback_Nm",
                "velocity": "speed",
                "temperature": "drive_temp_C",
            },
            {"position": np.pi / 180},
        ),
        (["a", "b"], {}, {}),
    ],
)
def test_columns_and_units_are_guessed_from_their_names(names, columns, scale):
    guess = guess_columns(names)
    assert guess.columns == columns
    assert guess.scale == pytest.approx(scale)


def test_a_current_and_an_angle_are_seen_and_what_is_given_is_believed():
    assert guess_columns(["t", "current_cmd_A", "position_m"]).current
    assert guess_columns(["t", "tau", "joint_angle"]).rotary
    assert guess_columns(["t", "x", "force"], {"position": "force", "torque": "x"}).columns == {
        "t": "t",
        "position": "force",
        "torque": "x",
    }


def test_how_an_axis_lies_and_its_inertia_are_guessed_from_its_motion(machines):
    right, near = 0, 0
    linear = [m for m in machines if not m.axis.is_rotary]
    for machine in linear:
        guess = guess_constants(machine.recording, rotary=False)
        right += guess.orientation is machine.axis.mechanics.orientation
        near += guess.inertia is not None and 0.4 < guess.inertia / machine.axis.mechanics.M < 2.5
        assert guess.sample_time == pytest.approx(0.01, rel=0.02)
    assert right >= 0.95 * len(linear)
    assert near >= 0.95 * len(linear)


@pytest.mark.parametrize("orientation", list(Orientation))
def test_an_axis_file_made_from_a_recording_alone_fits_it(machines, orientation, tmp_path, capsys):
    machine = of_kind(machines, orientation)
    bare = dataclasses.replace(machine.recording, velocity=None, temperature=None)
    position = "angle_rad" if machine.axis.is_rotary else "pos_mm"
    factor = 1.0 if machine.axis.is_rotary else 1e3
    columns = {"time_ms": bare.t * 1e3, "force_N": bare.force, position: bare.position * factor}
    write_csv(tmp_path / "drive log.csv", columns)
    out = tmp_path / "axis.toml"
    assert run("axes", "init", "--recording", tmp_path / "drive log.csv", "--out", out, "--yes", "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert result["audit"] in ("ok", "warn")
    assert not any(finding["severity"] == "refuse" for finding in result["findings"])
    axis = read_axis(out)
    assert axis.name == "drive-log"
    assert axis.mechanics.orientation is orientation
    assert not axis.mechanics.inertia_known
    assert axis.recordings[0].scale["t"] == 1e-3
    assert {"mass", "inertia"} & set(result["guessed"])


def test_options_outdo_guesses_and_a_wrong_sign_is_shown(machines, tmp_path, capsys):
    machine = of_kind(machines, Orientation.VERTICAL)
    gain, mass = machine.axis.mechanics.gain, machine.axis.mechanics.M
    write_recording(machine.recording, tmp_path / "r.csv", machine.axis)
    arguments = ["axes", "init", "--recording", tmp_path / "r.csv", "--yes", "--name", "z-1", "--mass", mass]
    arguments += ["--orientation", "vertical", "--force-per-torque", gain, "--rated-torque", 8]
    assert run(*arguments, "--out", tmp_path / "good.toml") == 0
    shown = capsys.readouterr().out
    assert "ok     sign" in shown
    assert "good enough" in shown
    axis = read_axis(tmp_path / "good.toml")
    assert (axis.name, axis.mechanics.M, axis.mechanics.inertia_known) == ("z-1", mass, True)
    assert axis.drive.rated_force == pytest.approx(8 * gain)
    assert run(*arguments, "--out", tmp_path / "bad.toml", "--scale", "torque=-1") == 0
    assert "refuse sign: force has the wrong sign" in capsys.readouterr().out


def test_a_mass_that_the_motion_contradicts_is_doubted_unless_it_is_called_rough(machines, tmp_path, capsys):
    """80 kg written for EMPS' 95 kg made friction wrong and sure of itself."""
    machine = of_kind(machines, Orientation.HORIZONTAL)
    write_recording(machine.recording, tmp_path / "r.csv", machine.axis)
    arguments = ["axes", "init", "--recording", tmp_path / "r.csv", "--yes", "--json", "--orientation", "horizontal"]
    arguments += ["--force-per-torque", machine.axis.mechanics.gain]
    moving = fit(machine.recording).mass
    for number, (share, more, doubted) in enumerate(
        [(0.8, [], True), (0.8, ["--mass-known"], True), (0.8, ["--mass-rough"], False), (1.0, [], False)]
    ):
        out = tmp_path / f"{number}.toml"
        assert run(*arguments, "--mass", share * moving, *more, "--out", out) == 0
        findings = json.loads(capsys.readouterr().out)["findings"]
        assert [one for one in findings if one["check"] == "known mass"] == ([findings[0]] if doubted else [])
        assert read_axis(out).mechanics.inertia_known == ("--mass-rough" not in more)
    assert run("axes", "check", "--axis", tmp_path / "0.toml") == 0
    assert "inertia_known = false" in capsys.readouterr().out


def test_one_run_of_many_is_chosen_and_a_file_of_many_is_hinted_at(machines, tmp_path, capsys):
    machine = of_kind(machines, Orientation.HORIZONTAL).recording
    twice = {"run": np.repeat([1.0, 2.0], len(machine)), "t": np.tile(machine.t, 2)}
    twice |= {"force": np.tile(machine.force, 2), "position": np.tile(machine.position, 2)}
    write_csv(tmp_path / "r.csv", twice)
    start = ["axes", "init", "--recording", tmp_path / "r.csv", "--yes"]
    assert run(*start, "--out", tmp_path / "one.toml", "--select", "run=2", "--orientation", "horizontal") == 0
    assert "choose one" not in capsys.readouterr().err
    assert read_axis(tmp_path / "one.toml").recordings[0].select == {"run": "2"}
    run(*start, "--out", tmp_path / "all.toml", "--mass", 10, "--orientation", "horizontal")
    assert "choose one with --select COLUMN=VALUE (columns: run)" in capsys.readouterr().err


def test_amperes_need_their_torque_constant(machines, tmp_path, capsys):
    machine = of_kind(machines, Orientation.HORIZONTAL)
    columns = {"t_s": machine.recording.t, "iq_A": machine.recording.force, "x_m": machine.recording.position}
    write_csv(tmp_path / "r.csv", columns)
    start = ["axes", "init", "--recording", tmp_path / "r.csv", "--yes", "--out", tmp_path / "a.toml"]
    assert run(*start) == 2
    assert "'iq_A' is a current" in capsys.readouterr().err
    assert run(*start, "--scale", "torque=1.0") == 0


def test_the_questions_build_the_same_axis_and_a_bad_answer_is_asked_again(tmp_path, capsys, monkeypatch):
    answers = ["x-axis", "hor", "200", "twenty", "20", "0.012", "0.045", "8", "0 2", "", "motor", "rough"]
    monkeypatch.setattr("sys.stdin", io.StringIO("\n".join(answers) + "\n"))
    assert run("axes", "init", "--out", tmp_path / "axis.toml") == 0
    said = capsys.readouterr()
    assert "mass [kg] is 'twenty', but must be a number > 0" in said.err
    axis = read_axis(tmp_path / "axis.toml")
    assert (axis.name, axis.mechanics.orientation, axis.sensor.side) == ("x-axis", Orientation.HORIZONTAL, "motor")
    assert (axis.mechanics.gain, axis.mechanics.M, axis.mechanics.J, axis.mechanics.Rc) == (200.0, 20.0, 0.012, 0.045)
    assert axis.drive.rated_force == 1600.0
    assert (axis.mechanics.travel, axis.stream.sample_time) == ((0.0, 2.0), 0.01)
    assert not axis.mechanics.inertia_known


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--yes"], "give --orientation"),
        (["--yes", "--orientation", "vertical"], "give --mass"),
        (["--yes", "--orientation", "tilted", "--mass", "1"], "'tilted'"),
        (["--yes", "--orientation", "rotary", "--inertia", "-1"], "inertia [kg*m^2] is '-1.0'"),
        (["--yes", "--name", "a/b"], "'a/b'"),
        (["--yes", "--recording", "none.csv"], "no such recording"),
    ],
)
def test_what_is_missing_or_wrong_is_named_and_nothing_is_written(arguments, words, tmp_path, capsys):
    assert run("axes", "init", "--out", tmp_path / "axis.toml", *arguments) == 2
    said = capsys.readouterr()
    assert words in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""
    assert not (tmp_path / "axis.toml").exists()


def test_an_axis_file_that_exists_is_kept_unless_forced(tmp_path, capsys):
    (tmp_path / "axis.toml").write_text("precious")
    arguments = ["axes", "init", "--out", tmp_path / "axis.toml", "--yes", "--orientation", "vertical", "--mass", 5]
    assert run(*arguments) == 2
    assert "--force" in capsys.readouterr().err
    assert (tmp_path / "axis.toml").read_text() == "precious"
    assert run(*arguments, "--force") == 0
    assert read_axis(tmp_path / "axis.toml").mechanics.M == 5.0


def test_pairs_are_checked():
    assert read_pairs("--column", ["t=time s"]) == {"t": "time s"}
    assert read_factors("--scale", ["torque=0.0934"]) == {"torque": 0.0934}
    for bad, words in (
        (["torque"], "name=value"),
        (["torqe=1"], "did you mean 'torque'"),
        (["torque=x"], "other than 0"),
    ):
        with pytest.raises(InputError, match=words):
            read_factors("--scale", bad)


def test_every_question_accepts_its_own_default():
    for orientation in Orientation:
        for uses_torque in (True, False):
            asked = [*first_questions("a", orientation), *questions(orientation, None, uses_torque=uses_torque)]
            for question in asked:
                if question.default is not None:
                    assert question.read(str(question.default)) == question.default


@pytest.mark.parametrize(("file", "name"), [("a b.csv.gz", "a-b"), ("alive.csv", "axis-0001"), ("_.csv", "axis-0001")])
def test_a_name_is_made_from_the_file(tmp_path, file, name):
    assert name_from(tmp_path / file) == name


# --- axes check -----------------------------------------------------------------------------------------------


def test_check_judges_every_listed_recording(machines, tmp_path, capsys):
    machine = of_kind(machines, Orientation.HORIZONTAL)
    write_recording(machine.recording, tmp_path / "good.csv", machine.axis)
    turned = dataclasses.replace(machine.recording, force=-machine.recording.force)
    write_recording(turned, tmp_path / "turned.csv", machine.axis)
    write_axis(machine.axis, tmp_path / "axis.toml")
    files = [tmp_path / "good.csv", tmp_path / "turned.csv"]
    assert run("axes", "check", *files, "--axis", tmp_path / "axis.toml", "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert [one["audit"] for one in result["recordings"]] == ["ok", "refuse"]
    assert result["audit"] == "refuse"
    assert run("axes", "check", "--axis", tmp_path / "axis.toml") == 2
    assert "no [[recording]] is listed" in capsys.readouterr().err


def test_check_listens_to_the_live_stream(machines, tmp_path, capsys):
    machine = of_kind(machines, Orientation.VERTICAL)
    write_axis(machine.axis, tmp_path / "axis.toml")
    endpoint = f"unixsock-stream/{tmp_path}/z.sock"
    turned = dataclasses.replace(machine.recording, position=-machine.recording.position)
    stop = threading.Event()

    def publish(publisher):
        while not stop.wait(0.05):
            for block in recording_blocks([turned], machine.axis.name, epoch=time.time_ns(), start_ns=time.time_ns()):
                publisher.put(block)

    with open_session("peer", listen=[endpoint]) as session:
        with SamplePublisher(session, "plant-1", machine.axis.name) as publisher:
            thread = threading.Thread(target=publish, args=(publisher,))
            thread.start()
            arguments = ["--stream", "--seconds", 1.5, "--connect", endpoint, "--axis", tmp_path / "axis.toml"]
            try:
                assert run("axes", "check", *arguments) == 0
            finally:
                stop.set()
                thread.join()
        assert "position counts downwards" in capsys.readouterr().out
        quiet = ["--stream", "--seconds", 0.1, "--connect", endpoint, "--axis", tmp_path / "axis.toml"]
        assert run("axes", "check", *quiet) == 3
        assert "no block came" in capsys.readouterr().err


def test_heard_blocks_are_put_in_order_each_once_and_only_of_the_latest_epoch(machines):
    source = machines[0].recording
    old = list(recording_blocks([source], "a", epoch=1, start_ns=0))
    new = list(recording_blocks([source], "a", epoch=2, start_ns=0))
    heard = Heard([old[0], new[2], new[0], new[1], new[0]])
    got = as_recording(heard, Axis("a", Mechanics(M=1.0)))
    np.testing.assert_array_equal(got.force, source.force[:300])
    assert as_recording(Heard(), Axis("a", Mechanics(M=1.0))) is None
