"""Recordings in files: mapping, units, selection, every format, and complaints that name line and column."""

import dataclasses
import gzip
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

import plant
from plant import csv_files, parquet_files
from plant.axis import Axis, Mechanics, RecordingEntry, Stream, TorqueHold
from plant.errors import RecordingError
from plant.recording import Recording
from plant.recording_files import read_recording, read_recording_entry, write_recording

AXIS = Axis("a", Mechanics(M=1.0, force_per_torque=2.0), stream=Stream(0.01, TorqueHold.LINEAR))
PLAIN = dataclasses.replace(AXIS, mechanics=Mechanics(M=1.0))
GOOD = "t,torque,position\n0.0,1.0,0.5\n0.01,2.0,0.6\n"
DATA = Path(os.environ.get("TRIBOWATCH_DATA", Path(__file__).parents[3] / "shared" / "data"))


def put(folder, text, name="r.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def complaint(path, axis=AXIS):
    with pytest.raises(RecordingError) as caught:
        read_recording(path, axis)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_torque_becomes_force_at_the_belt_and_an_unlisted_file_takes_the_words_of_the_stream(tmp_path):
    recording = read_recording(put(tmp_path, GOOD), AXIS)
    assert recording.force.tolist() == [2.0, 4.0]
    assert recording.position.tolist() == [0.5, 0.6]
    assert (recording.hold, recording.sample_time, recording.loop) == (TorqueHold.LINEAR, 0.01, "open")
    assert recording.velocity is None


def test_force_is_taken_as_it_is_and_optional_columns_are_read(tmp_path):
    text = "t,force,position,velocity,temperature,load\n0,1,2,3,4,5\n"
    recording = read_recording(put(tmp_path, text), AXIS)
    assert recording.force.tolist() == [1.0]
    assert [recording.velocity[0], recording.temperature[0], recording.load[0]] == [3.0, 4.0, 5.0]


def test_columns_scale_and_select_of_the_axis_file_are_applied(tmp_path):
    text = "run,time,amps,mm\nA,0,10,1\nB,0,20,1\nB,1,30,2\nA,1,40,2\n"
    entry = RecordingEntry(
        put(tmp_path, text).resolve(),
        columns={"t": "time", "torque": "amps", "position": "mm"},
        scale={"torque": 0.1, "position": 1e-3, "t": 0.01},
        select={"run": "B"},
        loop="closed",
        hold=TorqueHold.MEAN,
        note="today",
    )
    axis = dataclasses.replace(AXIS, recordings=(entry, dataclasses.replace(entry, select={"run": "A"})))
    recording = read_recording(tmp_path / "r.csv", axis)  # the first entry on the file counts
    assert recording.force.tolist() == [4.0, 6.0]
    assert recording.position.tolist() == [0.001, 0.002]
    assert recording.t.tolist() == [0.0, 0.01]
    assert (recording.loop, recording.hold, recording.note) == ("closed", TorqueHold.MEAN, "today")
    assert recording.source.endswith("[run=B]")
    assert read_recording_entry(axis.recordings[1], axis).force.tolist() == [2.0, 8.0]


@pytest.mark.parametrize("value", [2, 2.0, "2", "2.0"])
@pytest.mark.parametrize("kind", ["csv", "csv.gz", "parquet", "mat"])
def test_selected_values_compare_as_text_or_as_numbers_in_every_format(tmp_path, kind, value):
    columns = {"run": [1.0, 2.0, 2.0], "t": [0.0, 0.0, 1.0], "torque": [1.0, 2.0, 3.0], "position": [0.0, 1.0, 2.0]}
    arrays = {name: np.array(cells) for name, cells in columns.items()}
    path = tmp_path / f"r.{kind}"
    if kind == "mat":
        savemat(path, arrays)
    elif kind == "parquet":
        parquet_files.write_parquet(path, arrays)
    else:
        csv_files.write_csv(path, arrays)
    recording = read_recording_entry(RecordingEntry(path, select={"run": value}), AXIS)
    assert recording.force.tolist() == [4.0, 6.0]
    with pytest.raises(RecordingError, match=r"no row with run = 7; run has: 1(\.0)?, 2(\.0)?$"):
        read_recording_entry(RecordingEntry(path, select={"run": 7}), AXIS)


def test_a_struct_in_a_mat_file_is_reached_by_a_dotted_name(tmp_path):
    log = {"time": [0.0, 1.0], "F": [1.0, 2.0], "y": [3.0, 4.0]}
    savemat(tmp_path / "r.mat", {"log": log})
    columns = {"t": "log.time", "force": "log.F", "position": "log.y"}
    assert read_recording_entry(RecordingEntry(tmp_path / "r.mat", columns), AXIS).position.tolist() == [3.0, 4.0]


def test_empty_cells_nan_and_time_running_backwards_are_read_not_judged(tmp_path):
    recording = read_recording(put(tmp_path, "t,force,position\n1,,0.5\n0.5,nan,NaN\n0.2,3,inf\n"), AXIS)
    assert recording.t.tolist() == [1.0, 0.5, 0.2]
    assert np.isnan(recording.force[:2]).all()
    assert np.isnan(recording.position[1])


@pytest.mark.parametrize(
    "text",
    [
        "t;force;position\n0,5;1,25;2\n",
        "t\tforce\tposition\n0.5\t1.25\t2\n",
        "# a log\n\nt,force,position\n0.5,1.25,2\n",
    ],
)
def test_semicolons_with_decimal_commas_tabs_and_comments_are_understood(tmp_path, text):
    recording = read_recording(put(tmp_path, "\ufeff" + text), AXIS)
    assert (recording.t[0], recording.force[0], recording.position[0]) == (0.5, 1.25, 2.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["empty"]),
        ("t,torque,position\n", ["no samples"]),
        ("0,1,2\n0,1,2\n", ["line 1 should name the columns"]),
        ("t,t,torque,position\n", ["'t' twice"]),
        ("time,torque,position\n0,1,2\n", ["no column 't'", "time, torque, position", "columns = { t ="]),
        ("t,torque,pos\n0,1,2\n", ["no column 'position'", '{ position = "pos" }']),
        ("t,position\n0,1\n", ["no column 'torque' or 'force'"]),
        ("t,torque,force,position\n0,1,1,1\n", ["both torque and force"]),
        ("t,torque,position\n0,1,2\n\n1,abc,2\n", ["line 4", "'torque'", "'abc' is not a number"]),
        ("# log\nt,torque,position\n0,1,2\n1,1,x\n", ["line 4", "'position'", "'x'"]),
        ("t,torque,position\n0,1,2\n1,1_0,2\n", ["line 3", "'1_0'"]),
        ("t,torque,position\n0,1,2\n1,1\n", ["line 3 has 2 cells", "3 columns"]),
    ],
)
def test_a_bad_table_is_one_line_that_names_the_place(tmp_path, text, words):
    line = complaint(put(tmp_path, text))
    for word in words:
        assert word in line


def test_line_numbers_count_the_lines_of_other_runs_too(tmp_path):
    path = put(tmp_path, "run,t,torque,position\n1,0,x,0\n2,0,1,0\n2,1,oops,0\n")
    with pytest.raises(RecordingError, match=r"line 4, column 'torque': 'oops'"):
        read_recording_entry(RecordingEntry(path, select={"run": 2}), AXIS)


def test_damaged_missing_and_unknown_files_are_named(tmp_path):
    whole = gzip.compress((GOOD * 200).encode())
    (tmp_path / "cut.csv.gz").write_bytes(whole[:-30])
    (tmp_path / "no.csv.gz").write_text(GOOD)
    (tmp_path / "junk.parquet").write_bytes(b"junk")
    (tmp_path / "junk.mat").write_bytes(b"junk" * 100)
    (tmp_path / "empty.mat").write_bytes(b"")
    (tmp_path / "bytes.csv").write_bytes(b"t,torque,position\n\xff\xfe,1,2\n")
    (tmp_path / "folder.csv").mkdir()
    for path in sorted(tmp_path.iterdir()):
        assert "cannot be read" in complaint(path)
    assert "no such recording" in complaint(tmp_path / "none.csv")
    assert "not a kind of recording we read" in complaint(tmp_path / "r.xls")


def test_text_columns_and_uneven_lengths_are_refused_outside_csv_too(tmp_path):
    import pyarrow
    import pyarrow.parquet

    table = pyarrow.table({"t": [0.0, 1.0], "torque": ["a", "b"], "position": [0.0, 1.0]})
    pyarrow.parquet.write_table(table, tmp_path / "r.parquet")
    assert "'torque' holds string" in complaint(tmp_path / "r.parquet")
    savemat(tmp_path / "r.mat", {"t": [0.0, 1.0], "torque": [1.0, 2.0], "position": [0.0, 1.0, 2.0]})
    assert "differ in length" in complaint(tmp_path / "r.mat")


def test_parquet_time_stamps_become_seconds_and_nulls_nan(tmp_path):
    import pyarrow
    import pyarrow.parquet

    stamps = pyarrow.array([1_700_000_000_000_000, 1_700_000_000_010_000], pyarrow.timestamp("us"))
    pyarrow.parquet.write_table(
        pyarrow.table({"t": stamps, "force": [1.0, None], "position": pyarrow.array([1, 2], pyarrow.int16())}),
        tmp_path / "r.parquet",
    )
    recording = read_recording(tmp_path / "r.parquet", AXIS)
    assert np.diff(recording.t)[0] == pytest.approx(0.01, abs=1e-12)
    assert np.isnan(recording.force[1])
    assert recording.position.tolist() == [1.0, 2.0]


def test_parquet_without_the_extra_names_the_extra(tmp_path, monkeypatch):
    (tmp_path / "r.parquet").write_bytes(b"")
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    assert "tribowatch[parquet]" in complaint(tmp_path / "r.parquet")


def test_a_scale_for_the_channel_that_is_not_there_is_refused(tmp_path):
    entry = RecordingEntry(put(tmp_path, GOOD), scale={"force": 2.0})
    with pytest.raises(RecordingError, match="scale names force, but the recording gives torque"):
        read_recording_entry(entry, AXIS)


floats = st.lists(st.floats(-1e9, 1e9, allow_subnormal=False) | st.just(float("nan")), min_size=3, max_size=3).map(
    np.array
)


kinds = st.sampled_from(["csv", "csv.gz", "parquet", "mat"])


@given(
    force=floats,
    position=floats,
    velocity=st.none() | floats,
    kind=kinds,
)
@settings(max_examples=40, deadline=None)
def test_a_written_recording_reads_back_to_the_bit(tmp_path_factory, force, position, velocity, kind):
    path = tmp_path_factory.mktemp("recordings") / f"r.{kind}"
    recording = Recording(np.array([0.0, 0.01, 0.03]), force, position, velocity)
    write_recording(recording, path, PLAIN)
    assert read_recording(path, PLAIN).sha256() == recording.sha256()
    write_recording(recording, path, AXIS)  # gain 2: written as torque, exact in binary
    assert read_recording(path, AXIS).sha256() == recording.sha256()


def test_writing_an_unknown_kind_or_into_a_missing_folder_is_refused(tmp_path):
    recording = Recording(np.zeros(1), np.zeros(1), np.zeros(1))
    with pytest.raises(RecordingError, match="are written as"):
        write_recording(recording, tmp_path / "r.xls", AXIS)
    for kind in ("csv", "csv.gz", "parquet", "mat"):
        with pytest.raises(RecordingError, match="cannot write"):
            write_recording(recording, tmp_path / "no" / f"r.{kind}", AXIS)


@pytest.mark.skipif(not (DATA / "emps").exists(), reason=f"no EMPS recordings under {DATA}: set TRIBOWATCH_DATA")
def test_the_emps_csv_and_the_authors_own_mat_file_are_the_same_run():
    axis = plant.read_axis(DATA / "emps" / "axis.toml")
    csv = plant.read_recording(DATA / "emps" / "emps_train.csv.gz", axis)
    columns = {"force": "vir", "position": "qm"}
    mat = read_recording_entry(RecordingEntry(DATA / "emps" / "DATA_EMPS.mat", columns, {"force": 35.15065}), axis)
    assert len(csv) == len(mat) == 24841
    np.testing.assert_allclose(csv.force, mat.force, atol=1e-4)
    assert csv.loop == "closed"
