# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenario files: what they say, what is refused, and when their faults begin and end."""

from __future__ import annotations

from pathlib import Path
import struct

from device_rig import drive_dictionary, with_defaults
import pytest

from arm_canopen import ConfigError
from arm_canopen.can import Frame
from arm_canopen.standard import AbortCode, DownloadRequest
from canopen_sim import DeviceHost, Fault, FaultInjection
from canopen_sim.faults.scenario import ScenarioPlayer, Step
from canopen_sim.faults.scenario_file import load_scenario
from canopen_sim.faults.text import parse_fault, split_settings

DEVICES = {'joint1': 2, 'joint2': 3}
EXAMPLES = sorted((Path(__file__).parents[1] / 'scenarios').glob('*.yaml'))
START = 50.0  # [s]


def load(tmp_path: Path, text: str) -> tuple[Step, ...]:
    """Read a scenario from a text, for two drives."""
    path = tmp_path / 'scenario.yaml'
    path.write_text(text, encoding='utf-8')
    return load_scenario(path, DEVICES, frozenset(DEVICES.values()))


class Stage:
    """Two drives in virtual time, with a scenario.

    Attributes:
        now: Virtual time in [s].
        host: The devices.
        done: What the player reported, with the time of each.
    """

    def __init__(self, steps: tuple[Step, ...]) -> None:
        """Switch on."""
        self.now = START
        self.done: list[tuple[float, str]] = []
        self.host = DeviceHost(lambda _frame: None)
        for node_id in DEVICES.values():
            self.host.add(node_id, with_defaults(drive_dictionary(), {(0x60FF, 0): 0}))
        self.player = ScenarioPlayer(
            self.host, steps, lambda text: self.done.append((self.now - START, text))
        )
        self.host.observers.append(self.player)
        self.host.advance(self.now)

    def run(self, duration: float) -> None:
        """Let time pass."""
        end = self.now + duration
        while self.host.deadline <= end:
            self.now = max(self.now, self.host.deadline)
            self.host.advance(self.now)
        self.now = end

    def write(self, node_id: int, index: int, value: int, size: int) -> None:
        """Write an object."""
        data = struct.pack('<i', value)[:size]
        frame = Frame(0x600 + node_id, DownloadRequest(index, 0, data, size).encode())
        self.host.receive(frame, self.now)

    def active(self, node_id: int) -> list[Fault]:
        """Return the faults that go on."""
        return [injection.fault for injection in self.host.device(node_id).faults.active]


def test_times_begin_with_the_devices(tmp_path: Path) -> None:
    """Faults begin at their time since the start, and end after their duration."""
    stage = Stage(
        load(
            tmp_path,
            """
            steps:
              - {after: 2.0, device: joint1, fault: disconnect, duration: 1.0}
              - {after: 1.0, device: [joint2], fault: sdo_silence, object: 0x6064}
              - {after: 4.0, device: all, end: all}
            """,
        )
    )
    stage.run(1.5)
    assert (stage.active(2), stage.active(3)) == ([], [Fault.SDO_SILENCE])
    stage.run(1.0)
    assert stage.active(2) == [Fault.DISCONNECT]
    stage.run(1.0)
    assert stage.active(2) == []
    stage.run(1.0)
    assert stage.active(3) == []
    assert stage.player.finished
    assert [round(time, 6) for time, _ in stage.done] == [1.0, 2.0, 4.0]


def test_event_of_another_device(tmp_path: Path) -> None:
    """A fault of one device begins so long after another one became operational."""
    stage = Stage(
        load(
            tmp_path,
            """
            steps:
              - when: {device: joint1, nmt: operational}
                after: 0.5
                device: joint2
                fault: heartbeat_stop
            """,
        )
    )
    stage.run(5.0)
    assert stage.done == []
    stage.host.receive(Frame(0, b'\x01\x02'), stage.now)
    stage.run(2.0)
    assert [time for time, _ in stage.done] == pytest.approx([5.5])


def test_event_of_a_position(tmp_path: Path) -> None:
    """A reboot in motion: the power is off as soon as the motor is beyond a position."""
    stage = Stage(
        load(
            tmp_path,
            """
            steps:
              - when: {device: joint1, position_above: 5000, drive: operation_enabled}
                device: joint1
                fault: reboot
                position_kept: false
            """,
        )
    )
    stage.write(2, 0x6060, 3, 1)
    for word in (6, 7, 15):
        stage.write(2, 0x6040, word, 2)
    stage.write(2, 0x60FF, 5000, 4)
    drive = stage.host.device(2).drive
    assert drive is not None
    stage.run(0.5)
    assert stage.done == []
    stage.run(3.0)
    assert len(stage.done) == 1
    assert abs(drive.position) < 500  # it counts from where it was when the power came back


def test_seed_of_the_file_is_that_of_every_fault(tmp_path: Path) -> None:
    """All random numbers of a scenario follow from one seed, unless a fault has its own."""
    steps = load(
        tmp_path,
        """
        seed: 7
        steps:
          - {device: 2, fault: tpdo_loss, probability: 0.05}
          - {device: '3', fault: rpdo_loss, count: 3, seed: 1}
        """,
    )
    assert steps == (
        Step((2,), FaultInjection(Fault.TPDO_LOSS, probability=0.05, seed=7)),
        Step((3,), FaultInjection(Fault.RPDO_LOSS, count=3, seed=1)),
    )


WRONG: dict[str, tuple[str, str, str]] = {
    'unknown device': (
        'steps:\n  - {device: jiont1, fault: reboot}',
        ":2: steps[0].device: unknown device 'jiont1'",
        "did you mean 'joint1'?",
    ),
    'unknown fault': (
        'steps:\n  - device: joint1\n    fault: tpdo_los',
        ":3: steps[0].fault: unknown fault 'tpdo_los'",
        "did you mean 'tpdo_loss'?",
    ),
    'setting of another fault': (
        'steps:\n  - {device: joint1, fault: tpdo_loss, delya: 3}',
        "unknown key 'delya'",
        'choose one of ',
    ),
    'fault of a drive without that axis number': (
        'steps:\n  - {device: joint1, fault: over_current, axis: first}',
        "axis is 'first'; expected a whole number",
        'correct it',
    ),
    'value of a setting': (
        'steps:\n  - {device: joint1, fault: tpdo_loss, probability: often}',
        "probability is 'often'; expected a number of 0 to 1",
        'correct it',
    ),
    'value out of range': (
        'steps:\n  - {device: joint1, fault: tpdo_loss, probability: 2}',
        'probability 2.0 is not 0 to 1',
        'correct it',
    ),
    'time in the past': (
        'steps:\n  - {device: joint1, fault: reboot, after: -1}',
        ':2: steps[0].after: -1 s is in the past',
        'write 0 or more',
    ),
    'no device': ('steps:\n  - {fault: reboot}', 'no device is named', 'joint1, joint2'),
    'neither fault nor end': (
        'steps:\n  - {device: joint1, after: 1}',
        "'fault' or 'end'",
        'write one of them',
    ),
    'both fault and end': (
        'steps:\n  - {device: joint1, fault: reboot, end: all}',
        "'fault' or 'end'",
        'write one of them',
    ),
    'no steps': ('seed: 3', "no list 'steps'", 'steps:'),
    'step is a word': ('steps:\n  - reboot', 'expected a step', '- after'),
    'unknown top-level key': ('stesp: []\nsteps: []', "unknown key 'stesp'", "'steps'"),
    'event of nothing': (
        'steps:\n  - {device: joint1, fault: reboot, when: {device: joint1}}',
        'the event has no condition',
        'nmt, drive, position_above',
    ),
    'event of all': (
        'steps:\n  - {device: joint1, fault: reboot, when: {device: all, nmt: stopped}}',
        'an event belongs to one device',
        'name one',
    ),
    'event of no known state': (
        'steps:\n  - {device: joint1, fault: reboot, when: {device: joint1, nmt: operationl}}',
        "unknown name 'operationl'",
        "'operational'",
    ),
    'no YAML': ('steps: [', 'not YAML', 'brackets'),
    'empty': ('', 'the file is empty', "begin with 'steps:'"),
}


@pytest.mark.parametrize('case', WRONG)
def test_errors_have_place_and_remedy(tmp_path: Path, case: str) -> None:
    """What cannot be played is refused as a whole, with file, line, key and remedy."""
    text, problem, remedy = WRONG[case]
    with pytest.raises(ConfigError) as refused:
        load(tmp_path, text)
    message = str(refused.value)
    assert message.startswith(str(tmp_path / 'scenario.yaml'))
    assert problem in message
    assert remedy in message
    assert len(refused.value.problems) == 1, message


def test_all_errors_at_once(tmp_path: Path) -> None:
    """Every error of a file is said, not only the first one."""
    with pytest.raises(ConfigError) as refused:
        load(tmp_path, 'steps:\n  - {device: a, fault: b}\n  - {device: joint1, fault: c}')
    assert len(refused.value.problems) == 3


def test_missing_file_is_a_scenario(tmp_path: Path) -> None:
    """The remedy for a missing file says of what kind it is."""
    with pytest.raises(ConfigError, match='correct the path of the scenario'):
        load_scenario(tmp_path / 'nothing.yaml', DEVICES, frozenset())


def test_position_of_what_is_no_drive(tmp_path: Path) -> None:
    """A device without a drive has no position to wait for."""
    path = tmp_path / 'scenario.yaml'
    path.write_text(
        'steps: [{device: joint1, fault: reboot, when: {device: joint1, position_above: 1}}]',
        encoding='utf-8',
    )
    with pytest.raises(ConfigError, match='not a drive'):
        load_scenario(path, DEVICES, frozenset())


def test_drive_fault_of_what_is_no_drive(tmp_path: Path) -> None:
    """A device without a drive cannot have a fault of one."""
    path = tmp_path / 'scenario.yaml'
    path.write_text('steps: [{device: joint1, fault: over_current}]', encoding='utf-8')
    with pytest.raises(ConfigError, match='device 2 is not a drive'):
        load_scenario(path, DEVICES, frozenset())


@pytest.mark.parametrize('path', EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_valid(path: Path) -> None:
    """The scenarios that are installed can be played on the Panda."""
    devices = {f'panda_joint{number}': number + 1 for number in range(1, 8)}
    assert load_scenario(path, devices, frozenset(devices.values()))


def test_settings_as_text() -> None:
    """A service's texts become typed values."""
    settings = split_settings(['object=0x607D:02', 'abort=hardware', ' count = 2'])
    assert parse_fault('sdo_abort', settings) == FaultInjection(
        Fault.SDO_ABORT, object=(0x607D, 2), abort=AbortCode.HARDWARE, count=2
    )
    assert not parse_fault('reboot', {'position_kept': 'lost'}).position_kept
    assert parse_fault('encoder_shifted', {'position': '-7000'}).position == -7000
    assert parse_fault('rate_units', {'velocity': '104.7'}).velocity == 104.7


@pytest.mark.parametrize('lines', [['delay'], ['=3'], ['delay=1', 'delay=2']])
def test_settings_that_are_none(lines: list[str]) -> None:
    """Texts without a name or a value, and repetitions, are refused."""
    with pytest.raises(ValueError, match=r'not a setting|stands twice'):
        split_settings(lines)


def test_setting_that_no_fault_has() -> None:
    """An unknown setting is refused with those that there are."""
    with pytest.raises(ValueError, match='duration'):
        parse_fault('sdo_delay', {'speed': '1'})
