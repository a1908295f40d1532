# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a halt ends in mode 1, with drives that differ in when they see and acknowledge a set-point.

Whatever the drive does, it goes to the new target or the answer is an error, and the move that was
halted does not go on.
"""

from __future__ import annotations

from enum import auto, Enum
from functools import partial
import math

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, MOTION_WRITES, PERIOD, SCALE, sdo_write
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from arm_canopen import DriveError, OperationMode, Severity
from arm_canopen.can import Frame
from arm_canopen.cia402.halt import UNDER_HALT_TIME
from arm_canopen.standard import Controlword, Statusword

pytestmark = pytest.mark.slow

JOINT = 'joint1'
NODE_ID = 2
STATUS_PDO = 0x180 + NODE_ID
COMMAND_PDO = 0x200 + NODE_ID
OLD = 3.0  # [rad] the target that a halt gives up; the axis never gets there
BRAKING = 0.1  # [rad] from the profile velocity, 1 rad/s, at 5 rad/s^2
ACCURACY = 5e-3  # [rad]
ANSWER_MAX = 3.5  # [s] to the answer and the end of the move
RESTS_AFTER = 0.3  # [s] without a motion after the answer
HALT_OPTION = 0x605D


class Kind(Enum):
    """When a drive sees the edge of bit 4, and whether it raises bit 12."""

    ALWAYS = auto()
    NEVER_ACKNOWLEDGES = auto()
    AFTER_HALT = auto()  # bit 4 counts as 0 while bit 8 is set
    EDGE_AFTER_HALT = auto()  # an edge that came under halt is lost for good
    WORD_AFTER_HALT = auto()  # so is one in the word that ends the halt


class SetPoints:
    """Makes a kind of drive of the simulated one, which takes set-points at any time."""

    def __init__(self, net: VirtualNetwork, kind: Kind) -> None:
        """Alter its controlwords and statuswords from now on."""
        self._kind = kind
        self._offered = self._lost = self._halted = False
        net.wire.alters = self

    def __call__(self, sender: str, frame: Frame) -> Frame:
        """Take out bit 4 where it is not seen, or bit 12."""
        data = bytearray(frame.data)
        if frame.can_id == STATUS_PDO and self._kind is Kind.NEVER_ACKNOWLEDGES:
            data[1] &= ~(Statusword.SET_POINT_ACKNOWLEDGE >> 8)
        elif frame.can_id == COMMAND_PDO and self._is_lost(int.from_bytes(data[:2], 'little')):
            data[0] &= ~int(Controlword.NEW_SET_POINT)
        return frame._replace(data=bytes(data))

    def _is_lost(self, word: int) -> bool:
        before, self._halted = self._halted, bool(word & Controlword.HALT)
        offered = bool(word & Controlword.NEW_SET_POINT)
        rising, self._offered = offered and not self._offered, offered
        blind = self._halted or (before and self._kind is Kind.WORD_AFTER_HALT)
        self._lost = offered and (self._lost or (rising and blind))
        if self._kind is Kind.AFTER_HALT:
            return self._halted
        return self._lost and self._kind in (Kind.EDGE_AFTER_HALT, Kind.WORD_AFTER_HALT)


def moving(kind: Kind, option: int = 1, *, leads: bool = False) -> VirtualNetwork:
    """Return a network whose drive begins to go to a target in mode 1."""
    writes = (*MOTION_WRITES, sdo_write(HALT_OPTION, 0, option))
    config = drive_config(JOINT, NODE_ID, sdo_writes=writes)
    if leads:
        config = drive_config(JOINT, NODE_ID, sdo_writes=writes, rpdos=config.rpdos[::-1])
    net = VirtualNetwork(bus_config(config))
    net.boot()
    SetPoints(net, kind)
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(OLD)
    return net


def motor(net: VirtualNetwork) -> float:
    """Return where the motor really is in [rad]."""
    drive = net.devices[JOINT].drive
    assert drive is not None
    return drive.position / SCALE


def answer(net: VirtualNetwork, target: float) -> tuple[str, float]:
    """Command a target as ~/target does, and let the axis come to rest.

    Returns:
        The answer, empty when it was refused, and how far the axis went towards the old target,
        beyond the way to the new one, in [rad].
    """
    begin = motor(net)
    allowed = max(0.0, target - begin)
    commands = net.commands[JOINT]
    promise = commands.deliver(lambda: commands.set_target(target))
    beyond, last, still = 0.0, math.nan, 0
    for _ in range(round(ANSWER_MAX / PERIOD)):
        net.run(PERIOD)
        still = still + 1 if promise.done and motor(net) == last else 0
        if still * PERIOD > RESTS_AFTER:
            break
        last = motor(net)
        beyond = max(beyond, last - begin - allowed)
    assert promise.done
    return ('' if promise.error is not None else str(promise.result())), beyond


@pytest.mark.parametrize('kind', Kind)
@settings(max_examples=5)
@given(
    new=st.floats(-0.5, 0.5),
    option=st.sampled_from([1, 2, 3, 4]),
    under_way=st.floats(0.05, 1.5),
    leads=st.booleans(),
)
def test_a_halt_ends_with_the_new_target_or_with_an_error(
    kind: Kind, new: float, option: int, under_way: float, leads: bool
) -> None:
    """The axis goes to the new target and never on to the old one; else the answer says so."""
    net = moving(kind, option, leads=leads)
    net.run(under_way)
    net.do(JOINT, 'halt', preempt=True)
    for target in (new, -new):  # what was learned of the drive holds the second time, too
        reported, beyond = answer(net, target)
        if reported:
            assert motor(net) == pytest.approx(target, abs=ACCURACY)
            assert beyond < ACCURACY
            assert not net.drives[JOINT].control.halted
        else:
            assert kind is Kind.WORD_AFTER_HALT
            assert beyond < BRAKING
            assert net.drives[JOINT].control.halted
            assert abs(net.drives[JOINT].view.velocity) < ACCURACY
        net.commands[JOINT].set_target(OLD)
        net.run(0.5)
        net.do(JOINT, 'halt', preempt=True)


@pytest.mark.parametrize('verb', ['halt', 'disable', 'select'])
def test_a_target_that_is_stopped_before_it_is_taken_is_an_error(verb: str) -> None:
    """Whoever stops the axis meanwhile, the answer is not that it goes there."""
    net = moving(Kind.AFTER_HALT)
    net.run(0.5)
    net.do(JOINT, 'halt', preempt=True)
    net.run(0.5)
    commands = net.commands[JOINT]
    promise = commands.deliver(lambda: commands.set_target(0.0))
    net.run(0.1)
    assert not promise.done
    if verb == 'select':
        net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    else:
        net.do(JOINT, verb, preempt=True)
    begin = motor(net)
    net.run(1.0)
    assert isinstance(promise.error, DriveError)
    assert motor(net) == pytest.approx(begin, abs=ACCURACY)


def test_only_the_first_target_waits_for_an_acknowledge_under_halt() -> None:
    """That a drive sees set-points only after a halt is learned, and no warning is due."""
    net = moving(Kind.EDGE_AFTER_HALT)
    commands = net.commands[JOINT]
    waited = []
    for target in (-0.1, 0.1):
        net.run(0.3)
        net.do(JOINT, 'halt', preempt=True)
        begin = net.now
        net.result(commands.deliver(partial(commands.set_target, target)))
        waited.append(net.now - begin)
    assert waited[0] > UNDER_HALT_TIME
    assert waited[1] < 10 * PERIOD
    assert not net.reported(Severity.WARNING)
