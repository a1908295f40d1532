# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Feed-forward of a stream: 0x60B1 and 0x60B2 go with its set-points and end with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math
import struct

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, pdo, PERIOD, SCALE, sdo_write
import pytest

from arm_canopen import AxisFeedback, OperationMode, Refusal, RefusalCause, Setpoint

JOINT = 'joint1'
NODE_ID = 2
OFFSET_PDO = 0x500 + NODE_ID
SPEED = 0.4  # [rad/s]
EFFORT = 30.0  # per mille of the rated torque
MODE = OperationMode.CYCLIC_POSITION


class Ramp:
    """A source that moves at a constant speed and announces it."""

    axes = (JOINT,)

    def __init__(self, velocity: float = SPEED, effort: float = EFFORT) -> None:
        self.losses: list[Refusal] = []
        self.pauses = False
        self._velocity = velocity
        self._effort = effort
        self._position: float | None = None

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[Setpoint | None]:
        """Go on while the axis follows."""
        axis = feedback[0]
        if self.pauses or not axis.followable:
            return [None]
        self._position = (axis.setpoint if self._position is None else self._position) + (
            SPEED * period
        )
        return [Setpoint(self._position, self._velocity, self._effort)]

    def released(self, axis: str, refusal: Refusal) -> None:
        """Keep the cause."""
        self.losses.append(refusal)


def follow(source: Ramp, *, mapped: bool = True, mode: OperationMode = MODE) -> VirtualNetwork:
    """Return a network with a drive that follows a source for half a second."""
    config = drive_config(JOINT, NODE_ID)
    if mapped:
        offsets = pdo(4, OFFSET_PDO, (0x60B1, 0), (0x60B2, 0))
        config = replace(config, rpdos=(*config.rpdos, offsets))
    net = VirtualNetwork(bus_config(config))
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, mode)
    net.master.attach(source)
    net.run(0.5)
    return net


def offsets(net: VirtualNetwork) -> tuple[int, int]:
    """Return what was sent last: velocity and torque in device units."""
    velocity, torque = struct.unpack_from('<ih', net.frames(OFFSET_PDO)[-1])
    return velocity, torque


def test_feed_forward_goes_with_the_set_points() -> None:
    """In device units, each cycle, and in the drive."""
    net = follow(Ramp())
    assert offsets(net) == (round(SPEED * SCALE), round(EFFORT))
    assert net.drives[JOINT].view.velocity == pytest.approx(SPEED, rel=0.05)
    node = net.network.nodes[JOINT]
    reported = net.result(net.network.scheduler.spawn(node.objects.read_object(0x60B1)))
    assert reported == round(SPEED * SCALE)


def test_it_ends_with_the_stream() -> None:
    """A pause, the end of the source, another target, a stop: nothing of it is left over."""
    source = Ramp()
    net = follow(source)
    source.pauses = True
    net.run(2 * PERIOD)
    assert offsets(net) == (0, 0)

    net = follow(source := Ramp())
    net.master.detach(source)
    net.run(2 * PERIOD)
    assert offsets(net) == (0, 0)

    for verb in ('halt', 'quick_stop', 'disable'):
        net = follow(Ramp())
        net.begin(JOINT, verb, preempt=True)
        net.run(2 * PERIOD)
        assert offsets(net) == (0, 0)

    net = follow(Ramp())
    net.commands[JOINT].set_target(0.0)
    net.run(2 * PERIOD)
    assert offsets(net) == (0, 0)


def test_a_switch_to_velocity_begins_without_it() -> None:
    """In mode 9 the drive adds 0x60B1 to its target: what is left over would be a motion."""
    net = follow(Ramp())
    net.select(JOINT, OperationMode.CYCLIC_VELOCITY)
    net.run(1.0)
    assert offsets(net) == (0, 0)
    assert net.drives[JOINT].view.velocity == pytest.approx(0.0, abs=0.005)


def test_it_does_not_come_back_with_the_device() -> None:
    """After a power cut the image is as without a stream."""
    net = follow(Ramp())
    net.power_off(JOINT)
    net.run(1.0)
    begin = net.now
    net.power_on(JOINT)
    net.run_until(net.all_ready)
    net.run(0.2)
    sent = {data[:6] for data in net.frames(OFFSET_PDO, since=begin)}
    assert sent == {bytes(6)}


@pytest.mark.parametrize('mode', [MODE, OperationMode.INTERPOLATED_POSITION])
def test_without_the_objects_in_an_rpdo_the_position_is_followed_alone(
    mode: OperationMode,
) -> None:
    """Nothing is refused, and no SDO writes it."""
    source = Ramp()
    net = follow(source, mapped=False, mode=mode)
    assert net.drives[JOINT].view.velocity == pytest.approx(SPEED, rel=0.05)
    assert not source.losses
    sent = [data for data in net.frames(0x600 + NODE_ID) if data[1:3] == b'\xb1\x60']
    assert not [data for data in sent if data[0] >> 5 == 1]  # a download; it is read once


@pytest.mark.parametrize(
    ('velocity', 'effort'),
    [(math.nan, 0.0), (0.0, math.inf), (1e12, 0.0), (0.0, 40_000.0), (2.0, 0.0), (0.0, 5_000.0)],
)
def test_a_feed_forward_that_cannot_be_is_refused(velocity: float, effort: float) -> None:
    """Not finite, too large for its object or beyond 0x607F or 0x6072: the axis is released."""
    source = Ramp(velocity, effort)
    net = follow(source)
    assert len(source.losses) == 1
    assert source.losses[0].cause is RefusalCause.SETPOINT_REFUSED
    assert net.drives[JOINT].view.velocity == pytest.approx(0.0, abs=0.005)
    assert {data[:6] for data in net.frames(OFFSET_PDO)} == {bytes(6)}


def test_an_offset_of_somebody_else_stays() -> None:
    """A stream without feed-forward, and no stream at all, leave 0x60B2 as bus.yml has it."""
    config = drive_config(JOINT, NODE_ID)
    carried = pdo(4, OFFSET_PDO, (0x60B1, 0), (0x60B2, 0))
    writes = (*config.sdo_writes, sdo_write(0x60B2, 0, 17))
    net = VirtualNetwork(
        bus_config(replace(config, rpdos=(*config.rpdos, carried), sdo_writes=writes))
    )
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, MODE)
    net.master.attach(Ramp(0.0, 0.0))
    net.run(0.5)
    assert net.drives[JOINT].view.velocity == pytest.approx(SPEED, rel=0.05)
    assert offsets(net) == (0, 17)
