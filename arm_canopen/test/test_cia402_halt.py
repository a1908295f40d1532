# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A halt wins over everything: over targets on their way, mode switches, streams and old moves."""

from __future__ import annotations

import pytest
from virtual_network import bus_config, drive_config, PERIOD, SCALE, VirtualNetwork

from arm_canopen.can.frame import Frame
from arm_canopen.cia402.position_modes import Move
from arm_canopen.exceptions import DriveError
from arm_canopen.master.events import Severity
from arm_canopen.standard.drive import OperationMode

JOINT = 'joint1'
NODE_ID = 2
COMMAND_PDO = 0x200 + NODE_ID


def running_in(mode: OperationMode, **changes: object) -> VirtualNetwork:
    """Return a network with one drive that is enabled in a mode."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, NODE_ID, **changes)))
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, mode)
    return net


def motor(net: VirtualNetwork) -> float:
    """Return where the motor really is in [rad]."""
    drive = net.devices[JOINT].drive
    assert drive is not None
    return drive.position / SCALE


def assert_rests(net: VirtualNetwork, duration: float = 2.0) -> None:
    """Check that the motor stays where it is for a time in [s]."""
    begin = motor(net)
    net.run(duration)
    assert motor(net) == pytest.approx(begin, abs=2e-3)


@pytest.mark.parametrize('delay', [0.0, 0.005, 0.01, 0.02, 0.03, 0.05])
@pytest.mark.parametrize(
    ('mode', 'target'),
    [
        (OperationMode.PROFILE_POSITION, 1.0),
        (OperationMode.PROFILE_VELOCITY, 0.3),
        (OperationMode.CYCLIC_POSITION, 1.0),
    ],
)
def test_a_halt_right_after_a_target_holds(
    mode: OperationMode, target: float, delay: float
) -> None:
    """Wherever the hand-over of the target stands: it is halted, and it stays halted."""
    net = running_in(mode)
    net.commands[JOINT].set_target(target)
    net.run(0.3)
    net.do(JOINT, 'halt', preempt=True)
    net.run(0.5)
    net.commands[JOINT].set_target(2.0 if mode is not OperationMode.PROFILE_VELOCITY else 0.3)
    net.run(delay)
    assert 'halted' in net.do(JOINT, 'halt', preempt=True)
    assert_rests(net)
    assert net.drives[JOINT].halted
    net.commands[JOINT].set_target(-0.2)
    net.run(4.0)
    assert not net.drives[JOINT].halted
    if mode is not OperationMode.PROFILE_VELOCITY:
        assert motor(net) == pytest.approx(-0.2, abs=2e-3)


def test_a_halt_drops_the_moves_that_the_drive_holds() -> None:
    """Five moves queued, two of them in the drive: the next target goes straight to its place."""
    net = running_in(OperationMode.PROFILE_POSITION)
    for n in range(5):
        net.commands[JOINT].move(Move(0.5 * (n + 1), immediate=False))
    net.run(0.4)
    net.do(JOINT, 'halt', preempt=True)
    rest = motor(net)
    net.run(0.5)
    net.commands[JOINT].set_target(0.0)
    highest = rest
    for _ in range(300):
        net.run(PERIOD)
        highest = max(highest, motor(net))
    assert highest < rest + 5e-3, 'it went on with an old move'
    assert motor(net) == pytest.approx(0.0, abs=2e-3)


def test_a_queued_move_after_a_halt_goes_at_once() -> None:
    """The halt has ended the moves before it, so there is nothing that it could wait for."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(2.0)
    net.run(0.4)
    net.do(JOINT, 'halt', preempt=True)
    rest = motor(net)
    assert 'at once' in net.commands[JOINT].move(Move(0.0, immediate=False))
    assert 'after the moves' in net.commands[JOINT].move(Move(0.1, immediate=False))
    highest = rest
    for _ in range(400):
        net.run(PERIOD)
        highest = max(highest, motor(net))
    assert highest < rest + 5e-3
    assert motor(net) == pytest.approx(0.1, abs=2e-3)


def test_a_target_that_is_not_taken_does_not_end_the_halt() -> None:
    """Without an acknowledge the drive stays halted, and that is said."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(2.0)
    net.run(0.4)
    net.do(JOINT, 'halt', preempt=True)

    def deaf(sender: str, frame: Frame) -> Frame:
        if frame.can_id != COMMAND_PDO:
            return frame
        return frame._replace(data=bytes((frame.data[0] & ~0x10,)) + frame.data[1:])

    net.wire.alters = deaf
    net.commands[JOINT].set_target(0.0)
    assert_rests(net, 4.0)
    assert net.drives[JOINT].halted
    assert any('stays halted' in text for text in net.told(Severity.WARNING))


def test_relative_moves_count_from_what_the_drive_has_or_gets() -> None:
    """An immediate one that waits is not lost by the next, and the answers are where they end."""
    net = running_in(OperationMode.PROFILE_POSITION)
    commands = net.commands[JOINT]
    assert 'to 1,' in commands.move(Move(1.0))
    assert 'to 1.5,' in commands.move(Move(0.5, relative=True))
    net.run(4.0)
    assert motor(net) == pytest.approx(1.5, abs=2e-3)
    for destination in ('1.6', '1.7', '1.8'):
        assert f'to {destination},' in commands.move(Move(0.1, relative=True))
    net.run(3.0)
    assert motor(net) == pytest.approx(1.8, abs=2e-3)
    assert net.drives[JOINT].setpoint == pytest.approx(1.8)
    commands.move(Move(0.1, relative=True))
    commands.move(Move(0.5))
    assert 'to 0.4,' in commands.move(Move(-0.1, relative=True))
    net.run(4.0)
    assert motor(net) == pytest.approx(0.4, abs=2e-3)


def test_a_relative_move_after_a_halt_is_refused() -> None:
    """It would count from the target that was given up; after an absolute one it is taken."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(2.0)
    net.run(0.5)
    net.do(JOINT, 'halt', preempt=True)
    with pytest.raises(DriveError, match=r'joint1: a relative move counts.*absolute'):
        net.commands[JOINT].move(Move(0.1, relative=True))
    assert_rests(net)
    net.commands[JOINT].move(Move(0.5))
    net.commands[JOINT].move(Move(0.1, relative=True))
    net.run(3.0)
    assert motor(net) == pytest.approx(0.6, abs=2e-3)
