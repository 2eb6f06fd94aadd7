"""Logs: bit for bit the same after saving, and errors for a file or table that is no log."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic
from logs import differences

from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.simulation.run_log import INTERRUPTED, RunLog


def test_a_saved_log_is_read_back_bit_for_bit(tmp_path):
    log = synthetic.walk_log(ending=INTERRUPTED)
    log.save(tmp_path / "log.npz")
    again = RunLog.load(tmp_path / "log.npz")
    assert differences(again, log) == []
    assert again.ending == INTERRUPTED
    assert not again.complete


def test_the_same_log_gives_the_same_file(tmp_path):
    for name in ("a.npz", "b.npz"):
        synthetic.walk_log().save(tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_differences_name_the_signal_and_forgive_wall_times():
    log, other = synthetic.walk_log(), synthetic.walk_log()
    other["solver_status"][:, 1] *= 2.0
    assert differences(log, other) == []
    other["lip_state"][3, 1] = np.nextafter(other["lip_state"][3, 1], 1.0)
    other["solver_status"][5, 3] += 1e-16
    assert differences(log, other) == ["lip_state", "solver_status"]


def test_elements_are_the_columns_of_the_table():
    log = synthetic.walk_log()
    assert np.array_equal(log.element("lip_state", "y_zmp"), log["lip_state"][:, 5])
    assert synthetic.signal_names() >= set(log.signals)


def test_rows_after_a_time_begin_with_that_tick():
    log = synthetic.walk_log()
    late = log.after(2.0)
    assert late.time[0] == pytest.approx(2.0)
    assert late.time[-1] == log.time[-1]
    assert np.array_equal(late["h"], log["h"][200:])


@pytest.mark.parametrize(
    ("signals", "says"),
    [
        ({"h": np.zeros((4, 1))}, r"signal 'h' must have shape \(5, size\), given \(4, 1\)"),
        ({"h": np.zeros(5)}, r"signal 'h' must have shape \(5, size\), given \(5,\)"),
        ({"ending": np.zeros((5, 1))}, "cannot be called 'ending'"),
    ],
)
def test_wrong_shapes_are_refused(signals, says):
    with pytest.raises(InputError, match=says):
        RunLog(signals, np.arange(5.0))


def test_a_missing_signal_lists_those_there_are():
    with pytest.raises(InputError, match=r"no signal 'hh'; it has .*com_reference, .*h, "):
        synthetic.walk_log()["hh"]
    with pytest.raises(InputError, match=r"'lip_state' has no element 'z'; it has x, vx, x_zmp"):
        synthetic.walk_log().element("lip_state", "z")


def test_a_file_that_is_no_log_is_named(tmp_path):
    path = tmp_path / "log.npz"
    with pytest.raises(RunFolderError, match=r"log\.npz does not exist"):
        RunLog.load(path)
    path.write_text("not a log")
    with pytest.raises(RunFolderError, match=r"log\.npz is not a run's log"):
        RunLog.load(path)
    synthetic.walk_log().save(path)
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(RunFolderError, match=r"log\.npz is not a run's log"):
        RunLog.load(path)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"time": np.arange(5.0)[::-1]}, "its time does not grow from row to row"),
        ({"time": np.array([0.0, 1.0, np.nan, 3.0, 4.0])}, "its time does not grow from row to row"),
        ({"time": np.array(["0", "1", "2", "3", "4"])}, "it is damaged"),
        ({"lip_state": np.zeros((5, 3))}, "signal 'lip_state' has 3 columns, 6 are needed"),
        ({"h": np.zeros(5)}, r"signal 'h' must have shape \(5, size\)"),
    ],
)
def test_a_table_that_no_run_wrote_is_refused(change, says, tmp_path):
    columns = {"time": np.arange(5.0), "ending": np.array("finished"), "lip_state": np.zeros((5, 6))} | change
    np.savez(tmp_path / "log.npz", **columns)
    with pytest.raises(RunFolderError, match=rf"log\.npz is not a run's log: {says}"):
        RunLog.load(tmp_path / "log.npz")


def test_a_single_array_is_no_log(tmp_path):
    np.save(tmp_path / "log.npy", np.zeros(3))
    (tmp_path / "log.npy").rename(tmp_path / "log.npz")
    with pytest.raises(RunFolderError, match=r"it is no \.npz file, or a damaged one"):
        RunLog.load(tmp_path / "log.npz")
    np.savez(tmp_path / "log.npz", h=np.zeros((3, 1)))
    with pytest.raises(RunFolderError, match="it has no time"):
        RunLog.load(tmp_path / "log.npz")


def test_the_finite_rows_end_before_the_first_with_nan_or_infinity():
    log = synthetic.walk_log()
    assert differences(log.finite(), log) == []
    log["lip_state"][350, 2], log["robot_state"][360:, 5] = np.nan, np.inf
    assert len(log.finite()) == 350
    assert log.finite().time[-1] == log.time[349]
    log["lip_state"][0, 2] = np.nan
    assert len(log.finite()) == 0


def test_a_log_with_a_signal_s_old_name_is_read(tmp_path):
    log = synthetic.walk_log()
    old = {"velocity_bound" if name == "barrier_bound" else name: table for name, table in log.signals.items()}
    RunLog(old, log.time, log.ending).save(tmp_path / "log.npz")
    again = RunLog.load(tmp_path / "log.npz")
    assert "velocity_bound" not in again
    assert differences(again, log) == []
