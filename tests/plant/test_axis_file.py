"""The axis file: the contract's example, every complaint, and writing what reads back equal."""

import pickle
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant.axis import Axis, Drive, Mechanics, Orientation, RecordingEntry, Sensor, Stream, TorqueHold
from plant.axis_file import read_axis, write_axis
from plant.errors import AxisFileError, InputError

EXAMPLE = """
name = "axis-0001"
[mechanics]
axis = "vertical"
M = 20.0
J = 0.012
Rc = 0.045
Re = 0.045
Rm = 0.0143
force_per_torque = 69.93
g = 9.81
travel = [0.0, 2.0]
inertia_known = true
[drive]
rated_torque = 8.0
torque_resolution = 0.008
[sensor]
position_resolution = 1e-5
side = "load"
[stream]
sample_time = 0.01
torque = "held over the sample"
[analysis]
sample_time = 0.01
[[recording]]
file = "recording.csv"
columns = { t = "t_s", force = "force_N", position = "position_m" }
scale = { force = 0.0934 }
select = { run = "0m20" }
sample_time = 0.01
loop = "closed"
torque = "linear between samples"
note = "commissioning"
"""
MINIMAL = 'name = "a"\n[mechanics]\nM = 1\n'


def write(folder: Path, text: str) -> Path:
    path = folder / "axis.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_contract_example_is_read_with_torques_as_forces_at_the_belt(tmp_path):
    axis = read_axis(write(tmp_path, EXAMPLE))
    assert axis.name == "axis-0001"
    assert axis.mechanics.gain == 69.93
    assert axis.drive.rated_force == pytest.approx(8.0 * 69.93)
    assert axis.drive.force_resolution == pytest.approx(0.008 * 69.93)
    assert axis.mechanics.travel == (0.0, 2.0)
    assert (axis.analysis_sample_time, axis.stream.sample_time) == (0.01, 0.01)
    (entry,) = axis.recordings
    assert entry.file == (tmp_path / "recording.csv").resolve()
    assert (entry.hold, entry.loop, entry.note) == (TorqueHold.LINEAR, "closed", "commissioning")
    assert entry.select == {"run": "0m20"}
    pickle.loads(pickle.dumps(axis))  # travels to worker processes


def test_a_minimal_file_gets_the_contract_defaults(tmp_path):
    axis = read_axis(write(tmp_path, MINIMAL))
    assert axis.mechanics.orientation is Orientation.VERTICAL
    assert axis.sensor == Sensor(0.0, "load")
    assert axis.stream.hold is TorqueHold.HOLD
    assert axis.mechanics.inertia_known


def test_rated_force_is_taken_as_it_is_and_a_negative_gain_keeps_it_positive(tmp_path):
    text = 'name = "a"\n[mechanics]\nM = 1\nforce_per_torque = -10\n[drive]\nrated_torque = 2\nforce_resolution = 0.5'
    assert read_axis(write(tmp_path, text)).drive == Drive(20.0, 0.5)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("M = 1", "mass = 1", ["[mechanics]", "'mass'", "unknown key", "did you mean 'M'"]),
        ("M = 1", "xyz = 1", ["'xyz'", "did you mean", "allowed here: axis, M, J"]),
        ("M = 1", "m = 1", ["'m'", "did you mean 'M'"]),
        ("M = 1", "M = 1\ntravell = [0, 1]", ["'travell'", "did you mean 'travel'"]),
        ('name = "a"', 'name = "a"\nmechanic = 1', ["'mechanic'", "did you mean 'mechanics'"]),
        ('name = "a"', "", ["name is missing"]),
        ('name = "a"', "name = 3", ["name is 3"]),
        ('name = "a"', 'name = "alive"', ["'alive'", "not allowed"]),
        ("[mechanics]\nM = 1", "", ["[mechanics] is missing"]),
        ("M = 1", 'M = "20"', ["M is '20'", "number >= 0", "[kg]"]),
        ("M = 1", "M = -2.5", ["M is -2.5 kg", ">= 0"]),
        ("M = 1", "M = true", ["M is True"]),
        ("M = 1", "M = 1e300", ["M is 1e+300 kg", "up to 1e+09"]),
        ("M = 1", "M = 1\nRc = 1e-300", ["Rc is 1e-300 m", "> 0"]),
        ("M = 1", "M = 1\ntravel = [-1e300, 1]", ["travel", "up to 1e+09"]),
        ("M = 1", "M = 0\nJ = 1e-9\nRc = 1e3", ["moving mass", "kg"]),
        ("M = 1", "M = nan", ["M is nan"]),
        ("M = 1", "M = 0", ["moving mass", "kg"]),
        ("M = 1", 'axis = "rotary"\nM = 1', ["M is 1 kg", "rotary"]),
        ("M = 1", 'M = 1\naxis = "diagonal"', ["'diagonal'", '"vertical" or "horizontal" or "rotary"']),
        ("M = 1", "M = 1\ntravel = [2, 0]", ["travel is [2, 0] m or rad", "lowest, highest"]),
        ("M = 1", "M = 1\nforce_per_torque = 0", ["force_per_torque is 0 N per N*m"]),
        ("M = 1", 'M = 1\n[sensor]\nside = "middle"', ["[sensor]", "'middle'"]),
        ("M = 1", "M = 1\n[drive]\nrated_torque = 1\nrated_force = 1", ["[drive]", "not both"]),
        ("M = 1", "M = 1\n[stream]\nsample_time = 0", ["[stream]", "sample_time is 0 s", "> 0"]),
        ("M = 1", "M = 1\n[analysis]\nsample_tim = 1", ["[analysis]", "did you mean 'sample_time'"]),
        ("M = 1", "M = 1\n[recording]\nfile = 'x'", ["[[recording]]"]),
        ("M = 1", "M = 1\n[[recording]]\nnote = 'x'", ["[[recording]] 1", "file is missing"]),
        ("M = 1", "M = 1\n[[recording]]\nfile='x'\n[[recording]]\nfil='x'", ["[[recording]] 2", "did you mean 'file'"]),
        ("M = 1", "M = 1\n[[recording]]\nfile='x'\ncolumns={torqe='y'}", ["columns", "did you mean 'torque'"]),
        ("M = 1", "M = 1\n[[recording]]\nfile='x'\nscale={torque='y'}", ["scale", "numbers"]),
        ("M = 1", "M = 1\n[[recording]]\nfile='x'\ncolumns={torque='y', force='z'}", ["both torque and force"]),
        ("M = 1", "M = 1\n[[recording]]\nfile='x'\nloop='shut'", ["'shut'", "open"]),
        ("M = 1", "M = 1\nM = 2", ["not valid TOML", "line 4"]),
    ],
)
def test_each_mistake_is_one_line_with_file_and_place(tmp_path, old, new, words):
    path = write(tmp_path, MINIMAL.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_axis(path)
    line = str(caught.value)
    assert str(path) in line
    assert "\n" not in line
    for word in words:
        assert word in line


def test_unreadable_files_are_named(tmp_path):
    with pytest.raises(AxisFileError, match="no such axis file"):
        read_axis(tmp_path / "none.toml")
    with pytest.raises(AxisFileError, match="cannot read"):
        read_axis(tmp_path)
    (tmp_path / "x.toml").write_bytes(b"name = '\xff'")
    with pytest.raises(AxisFileError, match="UTF-8"):
        read_axis(tmp_path / "x.toml")


numbers = st.floats(1e-6, 1e6)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
entries = st.builds(
    RecordingEntry,
    file=st.sampled_from(["a.csv", "sub/b.mat", 'o"dd name.csv']).map(Path),
    columns=st.dictionaries(st.sampled_from(["t", "torque", "position"]), texts),
    scale=st.dictionaries(st.sampled_from(["t", "load"]), numbers),
    select=st.dictionaries(texts, st.one_of(texts, st.integers(-9, 9), numbers)),
    sample_time=st.none() | numbers,
    loop=st.sampled_from(["open", "closed"]),
    hold=st.sampled_from(TorqueHold),
    note=texts,
)
mechanics = st.builds(
    Mechanics,
    orientation=st.sampled_from([Orientation.VERTICAL, Orientation.HORIZONTAL]),
    M=numbers,
    J=numbers,
    Rc=numbers,
    Re=st.none() | numbers,
    Rm=numbers,
    force_per_torque=st.none() | numbers,
    g=numbers,
    travel=st.none() | st.tuples(st.floats(-9, -1), numbers),
    inertia_known=st.booleans(),
)
axes = st.builds(
    Axis,
    name=st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}", fullmatch=True).filter(lambda name: name != "alive"),
    mechanics=mechanics,
    drive=st.builds(Drive, st.none() | numbers, numbers),
    sensor=st.builds(Sensor, numbers, st.sampled_from(["load", "motor"])),
    stream=st.builds(Stream, st.none() | numbers, st.sampled_from(TorqueHold)),
    analysis_sample_time=st.none() | numbers,
    recordings=st.lists(entries, max_size=2).map(tuple),
)


@given(axis=axes)
@settings(max_examples=60, deadline=None)
def test_a_written_axis_reads_back_equal(tmp_path_factory, axis):
    import dataclasses

    folder = tmp_path_factory.mktemp("axes")
    placed = [dataclasses.replace(entry, file=(folder / entry.file).resolve()) for entry in axis.recordings]
    axis = dataclasses.replace(axis, recordings=tuple(placed))
    write_axis(axis, folder / "axis.toml")
    assert read_axis(folder / "axis.toml") == axis
    assert "# kg, mass in translation" in (folder / "axis.toml").read_text(encoding="utf-8")


def test_writing_into_a_missing_folder_says_so(tmp_path):
    with pytest.raises(AxisFileError, match="cannot write"):
        write_axis(Axis("a", Mechanics(M=1.0)), tmp_path / "no" / "axis.toml")
