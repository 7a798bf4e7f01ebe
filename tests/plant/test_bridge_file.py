"""The bridge file: what it may say, and one clear line for everything else."""

import re

import pytest

from plant.axis import Axis, Drive, Mechanics
from plant.axis_file import write_axis
from plant.bridge_file import is_bridge_file, read_bridge
from plant.errors import InputError

HEAD = 'name = "b-1"\nsite = "s"\n[can]\ninterface = "virtual"\nchannel = "x"\n'
DRIVE = '[[axis]]\nname = "axis-1"\nnode = 1\ncounts_per_unit = 1e6\nrated_torque = 8.0\n'
DBC = """\
VERSION ""
NS_ :
BS_:
BU_: M
BO_ 385 AX1: 8 M
 SG_ Position : 0|32@1- (0.001,0) [0|0] "mm" M
 SG_ Torque : 32|16@1- (0.008,0) [0|0] "Nm" M
"""


def read(folder, text):
    path = folder / "bridge.toml"
    path.write_text(text)
    return read_bridge(path)


def complaint(folder, text):
    with pytest.raises(InputError) as caught:
        read(folder, text)
    assert "\n" not in str(caught.value)
    assert "bridge.toml" in str(caught.value)
    return str(caught.value)


def test_a_short_file_takes_every_default(tmp_path):
    settings = read(tmp_path, HEAD + DRIVE)
    assert (settings.block.samples, settings.time.period, settings.time.sync_id) == (100, 0.01, 0x80)
    assert settings.layout("axis-1").frames[0].objects == ("6041:16", "6064:32", "6077:16")
    assert settings.layout("axis-2") is None
    assert is_bridge_file(tmp_path / "bridge.toml")


def test_name_and_rated_torque_come_from_the_axis_file(tmp_path):
    axis = Axis("z-7", Mechanics(M=10.0, force_per_torque=20.0), Drive(rated_force=100.0))
    write_axis(axis, tmp_path / "axis.toml")
    drive = '[[axis]]\nfile = "axis.toml"\nnode = 1\ncounts_per_unit = 1e6\n'
    layout = read(tmp_path, HEAD + drive).layout("z-7")
    torque = next(signal for signal in layout.frames[0].signals if signal.channel == "torque")
    assert torque.scale == pytest.approx(5.0 / 1000)
    assert "says 5 N*m" in complaint(tmp_path, HEAD + drive + "rated_torque = 2.4\n")


def test_options_go_to_the_interface_as_they_are(tmp_path):
    settings = read(tmp_path, HEAD + "options = { port = 43113, hop_limit = 0 }\n" + DRIVE)
    assert dict(settings.options) == {"port": 43113, "hop_limit": 0}


def test_several_drives_and_a_dbc_on_one_bus(tmp_path):
    (tmp_path / "plant.dbc").write_text(DBC)
    dbc = '[[axis]]\nname = "d"\ndbc = "plant.dbc"\nsignals = { position = "AX1.Position", torque = "Torque" }\n'
    settings = read(tmp_path, HEAD + DRIVE.replace("node = 1", "node = 2") + dbc + "scale = { position = 0.001 }\n")
    assert [layout.axis for layout in settings.layouts] == ["axis-1", "d"]
    assert settings.layouts[1].frames[0].signals[0].scale == pytest.approx(1e-6)


def test_a_dbc_that_reaches_a_twentieth_of_rated_torque_is_remarked(tmp_path):
    write_axis(Axis("d", Mechanics(M=1.0, force_per_torque=1.0), Drive(rated_force=8.0)), tmp_path / "a.toml")
    (tmp_path / "plant.dbc").write_text(DBC.replace("(0.008,0)", "(0.000008,0)"))
    dbc = '[[axis]]\nfile = "a.toml"\ndbc = "plant.dbc"\nsignals = { position = "Position", torque = "Torque" }\n'
    assert "is the DBC's factor right" in read(tmp_path, HEAD + dbc).remarks[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense", "not valid TOML"),
        (DRIVE, "name is missing"),
        ('name = "b"\n' + DRIVE, "site is missing"),
        ('name = "b/c"\nsite = "s"\n' + DRIVE, "'b/c'"),
        (HEAD, "no drive is listed"),
        (HEAD + "chanel = 1\n" + DRIVE, "unknown key 'chanel'; did you mean 'channel'"),
        (HEAD + "[tiem]\nperiod = 1\n" + DRIVE, "did you mean 'time'"),
        (HEAD + "[time]\nperiod = 0\n" + DRIVE, "period is 0 s"),
        (HEAD + "[time]\nclock = 'never'\n" + DRIVE, "one of sync, arrival"),
        (HEAD + "[block]\nsamples = 0\n" + DRIVE, "samples is 0"),
        (HEAD + DRIVE.replace("node = 1", "node = 200"), "node of axis-1 is 200"),
        (HEAD + DRIVE.replace("counts_per_unit = 1e6\n", ""), "counts_per_unit is 0"),
        (HEAD + DRIVE.replace("rated_torque = 8.0\n", ""), "rated_torque is missing: 6077h"),
        (HEAD + DRIVE + 'pdo = ["6041:16"]\n', "pdo must be a list like"),
        (HEAD + DRIVE + "pdo = []\n", "[[axis]] 1: pdo must be a list like"),
        (HEAD + DRIVE + 'pdo = [{ id = -5, objects = ["6064:32", "6077:16"] }]\n', "pdo id is -0x5"),
        (HEAD + DRIVE + 'pdo = [{ id = 0xFFFFFFFFF, objects = ["6064:32"] }]\n', "0x1 ... 0x7ff, or left out"),
        (HEAD + DRIVE + 'pdo = [{ objects = ["6064:16", "6077:16"] }]\n', "has 32 bits in CiA 402"),
        (HEAD + DRIVE + 'pdo = [{ objects = ["6064:32"] }]\n', "with one of torque and force"),
        (HEAD + DRIVE + 'signals = { torque = "T" }\n', "signals goes with a DBC file"),
        (HEAD + DRIVE + DRIVE, "'axis-1' is listed twice"),
        (HEAD + DRIVE + DRIVE.replace("axis-1", "axis-2"), "0x181 belongs to axis-1 and to axis-2"),
        (HEAD + "[time]\nsync_id = 0x181\n" + DRIVE, "0x181 belongs to SYNC and to axis-1"),
        (HEAD + '[[axis]]\nname = "d"\ndbc = "none.dbc"\n', "none.dbc"),
        (HEAD + '[[axis]]\nfile = "none.toml"\nnode = 1\n', "none.toml"),
        (HEAD + "[[axis]]\nnode = 1\n", "name is missing"),
        (HEAD + "options = 3\n" + DRIVE, "options is 3"),
    ],
)
def test_everything_else_is_one_clear_line(tmp_path, text, words):
    said = complaint(tmp_path, text) if "none." not in text else None
    if said is None:
        with pytest.raises(InputError, match=re.escape(words)):
            read(tmp_path, text)
    else:
        assert words in said


def test_the_configuration_of_the_daemon_is_no_bridge_file(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text('site = "s"\n[[axis]]\nfile = "axis.toml"\n')
    assert not is_bridge_file(path)
    assert not is_bridge_file(tmp_path / "none.toml")
