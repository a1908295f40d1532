# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A black box: what it writes, when, how much it keeps, and what a bad disk does."""

from __future__ import annotations

from collections.abc import Callable
import logging
from pathlib import Path
import threading
import time

import pytest

from black_box import BlackBox, BlackBoxSettings, default_folder, Pause

DEADLINE = 30.0  # [s]


class Memory:
    """Contents of a black box: one line, written in the way that a test wants.

    Attributes:
        about: What it is of.
        saved_at: Steady times in [s] of each time that it was written.
        write: Writes a file.
    """

    about = 'memory of a test'

    def __init__(self, write: Callable[[Path], object] | None = None) -> None:
        self.saved_at: list[float] = []
        self.write = write or (lambda path: path.write_text('what was before'))

    def save(self, folder: Path, pause: Pause) -> Path:
        """Write the file."""
        self.saved_at.append(time.monotonic())
        pause()
        self.write(folder / 'memory.txt')
        return folder / 'memory.txt'

    def usage(self, path: Path) -> str:
        """Return a command."""
        return f'less {path}'


def settings(folder: Path, *, after: float = 0.0, window: float = 0.01) -> BlackBoxSettings:
    """Return settings of a box that writes soon, and again as soon."""
    return BlackBoxSettings(folder, window, after, kept=3)


def written(box: BlackBox, before: Path | None = None) -> Path:
    """Wait for a recording that is another one than before."""
    until(lambda: box.last not in (None, before))
    assert box.last is not None
    return box.last


def until(condition: Callable[[], bool]) -> None:
    """Wait for what a box does in its thread."""
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_a_fault_is_written_with_what_was_reported(tmp_path: Path) -> None:
    """The report has faults, notes and the command; the path is known by the device, too."""
    box = BlackBox('can_vcan0', Memory(), settings(tmp_path / 'made' / 'here', window=60.0))
    box.start()
    box.note('joint1', 'NMT state OPERATIONAL')
    box.fault('joint2', 'EMCY: over-current')
    box.close()
    path = written(box)
    assert path.read_text() == 'what was before'
    assert path.parent.name.startswith('can_vcan0_')
    assert path.parent.parent == tmp_path / 'made' / 'here'
    report = (path.parent / 'report.txt').read_text('utf-8')
    faults, _, reported = report.partition('reported:')
    assert 'memory of a test' in faults
    assert 'joint2: EMCY: over-current' in faults
    assert 'joint1: NMT state OPERATIONAL' not in faults
    assert 'joint1: NMT state OPERATIONAL' in reported
    assert f'less {path}' in reported
    assert box.recording_of('joint2') == path
    assert box.recording_of('joint1') is None


def test_what_follows_the_fault_is_in_it(tmp_path: Path) -> None:
    """It is written some time after the fault, and further faults of that time belong to it."""
    memory = Memory()
    box = BlackBox('bus', memory, settings(tmp_path, after=0.3))
    box.start()
    begin = time.monotonic()
    box.fault('joint1', 'first')
    box.fault('joint2', 'second')
    path = written(box)
    box.close()
    assert memory.saved_at[0] - begin >= 0.3
    assert len(memory.saved_at) == 1
    report = (path.parent / 'report.txt').read_text('utf-8')
    assert 'joint1: first' in report
    assert 'joint2: second' in report
    assert box.recording_of('joint1') == box.recording_of('joint2') == path


def test_the_end_of_the_program_waits_for_no_time(tmp_path: Path) -> None:
    """A fault right before the end is written at the end."""
    box = BlackBox('bus', Memory(), settings(tmp_path, after=3600.0))
    box.start()
    box.fault('', 'the master has ended by a defect')
    box.close()
    assert box.last is not None
    assert box.last.is_file()


def test_a_fault_that_repeats_does_not_fill_the_disk(tmp_path: Path) -> None:
    """Between two recordings there is a pause, whose faults are in the next one."""
    memory = Memory()
    box = BlackBox('bus', memory, settings(tmp_path, window=0.4))
    box.start()
    box.fault('', 'first')
    first = written(box)
    box.fault('', 'second')
    second = written(box, first)
    box.close()
    assert memory.saved_at[1] - memory.saved_at[0] >= 0.3
    assert 'second' in (second.parent / 'report.txt').read_text('utf-8')


def test_only_the_newest_are_kept(tmp_path: Path) -> None:
    """Of this box: others, and what people put there, stay; so does what was cut off not."""
    foreign = [tmp_path / 'bus_of_mine', tmp_path / 'can1_2026-01-01T00-00-00.000']
    cut_off = tmp_path / 'bus_2026-01-01T00-00-00.000.partial'
    for folder in (*foreign, cut_off):
        folder.mkdir()
    box = BlackBox('bus', Memory(), settings(tmp_path))
    box.start()
    paths: list[Path] = []
    for number in range(5):
        box.fault('', f'fault {number}')
        paths.append(written(box, paths[-1] if paths else None))
    box.close()
    assert [path.is_file() for path in paths] == [False, False, True, True, True]
    assert all(folder.is_dir() for folder in foreign)
    assert not cut_off.exists()


def fill_the_disk(path: Path) -> None:
    """Write a part, then to a device that is always full."""
    path.write_text('a part')
    with Path('/dev/full').open('w', encoding='ascii') as full:
        full.write('more')


def test_a_full_disk_is_reported_and_leaves_nothing_behind(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The fault is in the warning; the next one is written when there is room."""
    memory = Memory(fill_the_disk)
    box = BlackBox('bus', memory, settings(tmp_path))
    box.start()
    box.fault('joint1', 'too hot')
    until(lambda: 'No space left on device' in caplog.text)
    assert 'joint1: too hot' in caplog.text
    assert 'black_box_folder' in caplog.text
    assert box.last is None
    assert not list(tmp_path.iterdir())
    memory.write = lambda path: path.write_text('there is room')
    box.fault('joint1', 'too hot')
    assert written(box).read_text() == 'there is room'
    box.close()


def test_a_folder_that_cannot_be_made_is_reported(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Nothing is raised to the caller that reports the fault or ends the program."""
    occupied = tmp_path / 'a_file'
    occupied.touch()
    box = BlackBox('bus', Memory(), settings(occupied / 'black_box'))
    box.start()
    box.fault('', 'lost')
    box.close()
    assert f'the black box cannot be written to {occupied / "black_box"}' in caplog.text


def test_whoever_reports_a_fault_waits_for_no_disk(tmp_path: Path) -> None:
    """Faults are taken while a recording hangs."""
    hangs, goes_on = threading.Event(), threading.Event()

    def hang(path: Path) -> None:
        hangs.set()
        assert goes_on.wait(DEADLINE)
        path.write_text('at last')

    box = BlackBox('bus', Memory(hang), settings(tmp_path))
    box.start()
    box.fault('', 'first')
    assert hangs.wait(DEADLINE)
    for number in range(100):
        box.fault('', f'another {number}')
    assert box.last is None
    goes_on.set()
    box.close()
    assert box.last is not None


def test_a_defect_in_the_contents_ends_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """It is logged with its trace, and the next fault is written."""

    def fail(path: Path) -> None:
        raise ValueError(f'no idea of {path.name}')

    memory = Memory(fail)
    box = BlackBox('bus', memory, settings(tmp_path))
    box.start()
    with caplog.at_level(logging.ERROR):
        box.fault('', 'first')
        until(lambda: 'no idea of memory.txt' in caplog.text)
    memory.write = Memory().write
    box.fault('', 'second')
    assert written(box).is_file()
    box.close()


@pytest.mark.parametrize(
    ('environ', 'folder'),
    [
        ({'ROS_LOG_DIR': '/var/log/ros', 'ROS_HOME': '/x'}, '/var/log/ros/black_box'),
        ({'ROS_HOME': '/opt/robot'}, '/opt/robot/log/black_box'),
        ({}, f'{Path.home()}/.ros/log/black_box'),
        ({'ROS_LOG_DIR': ''}, f'{Path.home()}/.ros/log/black_box'),
    ],
)
def test_it_lies_beside_the_logs_of_ros(environ: dict[str, str], folder: str) -> None:
    """By the rules of rcl_logging."""
    assert default_folder(environ) == Path(folder)
