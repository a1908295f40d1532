# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The black box of a running master: a fault of a simulated drive, written and read back."""

from __future__ import annotations

from pathlib import Path
import re
import signal
import time
from typing import TYPE_CHECKING

from bus_recorder import BusRecorder
import can
from diagnostic_msgs.msg import DiagnosticArray
import pytest
from simulated_arm import SimulatedArm

from arm_msgs.srv import InjectFault
from canopen_core.can import read_log
from canopen_core.standard import CobId

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario

FAULTY = 4  # node id of panda_joint3
TOO_HOT = 0x4310


def diagnosed(messages: list[DiagnosticArray]) -> dict[str, str]:
    """Return the path of the black box by the name of the status, of the last message."""
    statuses = messages[-1].status if messages else []
    return {
        status.name: value.value
        for status in statuses
        for value in status.values
        if value.key == 'black_box'
    }


def _writes_at_its_end_what_it_saw_last(arm: SimulatedArm, folder: Path) -> None:
    """Drives that are lost right before Ctrl-C are written at the end, without the wait."""
    for joint in arm.joints:
        assert arm.client.trigger(f'/{joint}/shutdown').success
    before = set(folder.glob('*/can.log'))
    arm.slaves.signal(signal.SIGKILL)
    arm.master.wait_for('panda_joint1: heartbeat lost')
    assert arm.master.stop() == 0, arm.master.output
    assert 'heartbeat lost' in arm.master.wait_for(r'black box: .*can\.log', count=2)
    (path,) = set(folder.glob('*/can.log')) - before
    assert any(frame.can_id == CobId.SYNC for frame in read_log(path))


def test_a_fault_is_written_with_what_came_before_and_after(
    isolation: Isolation, tmp_path: Path
) -> None:
    """Log and /diagnostics have the path; what was on the bus is in the file, in its order."""
    folder = tmp_path / 'boxes'
    arguments = ('-p', f'black_box_folder:={folder}')
    with (
        BusRecorder(isolation.bus) as recorder,
        SimulatedArm(isolation, master_arguments=arguments) as arm,
    ):
        messages = arm.client.listen(DiagnosticArray, '/diagnostics')
        arm.init_all()
        fault_at = time.monotonic()
        fault = InjectFault.Request(fault='over_temperature')
        assert arm.client.call(InjectFault, '/fake_slaves/panda_joint3/fault', fault).success
        line = arm.master.wait_for(r'black box: .*can\.log')
        found = re.search(r'black box: (\S+)', line)
        assert found is not None
        path = Path(found[1])
        assert path.parent.parent == folder
        expected = {'master: bus': str(path), 'panda_joint3: drive': str(path)}
        arm.client.spin_until(
            lambda: {k: v for k, v in diagnosed(messages).items() if v} == expected,
            20.0,
            'path of the black box in /diagnostics',
        )
        recorder.pause()
        _writes_at_its_end_what_it_saw_last(arm, folder)

    ours = list(read_log(path))
    emergency = CobId.EMCY + FAULTY
    (raised,) = [
        number
        for number, frame in enumerate(ours)
        if frame.can_id == emergency and frame.data[:2] == TOO_HOT.to_bytes(2, 'little')
    ]
    before, after = ours[:raised], ours[raised:]
    assert after[-1].timestamp - after[0].timestamp > 2.0
    assert {frame.can_id for frame in before} >= {CobId.NMT, CobId.SYNC, 0x182, 0x202, 0x602}
    theirs = [(each.arbitration_id, bytes(each.data)) for each in can.LogReader(path)]
    assert theirs == [(frame.can_id, frame.data) for frame in ours]
    for can_id in (0x204, 0x584):  # commands of the master, answers of the drive
        of_box = iter([frame.data for frame in ours if frame.can_id == can_id])
        seen = [
            frame.data
            for frame in recorder.frames
            if frame.can_id == can_id and frame.timestamp < fault_at
        ]
        # a bystander that is too slow loses some; all that it saw are there, in their order
        assert seen
        assert all(data in of_box for data in seen)
    report = (path.parent / 'report.txt').read_text('utf-8')
    assert re.search(r'panda_joint3: .*0x4310', report), report
    assert 'panda_joint3 (4)' in report
