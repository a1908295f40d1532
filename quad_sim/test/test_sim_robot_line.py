# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The board at the end of its line takes whatever comes, and goes on."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from sim_serial import VirtualRobot

from quad_description import movable_joints, robot_urdf
from quad_hardware.protocol import (
    Access,
    Code,
    Frame,
    Kind,
    Protocol,
    Register,
    ROBOT_KINDS,
    V1,
    V2,
)
from quad_sim.board import MAX_LAG

pytestmark = pytest.mark.slow

KINEMATIC = ('--physics', 'none', '--noise', 'none')
LIMITS = movable_joints(robot_urdf('lite'))
QUESTION = {V1: Frame(Kind.READ, Register.BATTERY, b'\x01'), V2: Frame(Kind.READ, Code.BATTERY)}
both = pytest.mark.parametrize('protocol', [V1, V2], ids=['v1', 'v2'])


def answers(robot: VirtualRobot) -> bool:
    """Return whether a question is answered, after the pause in which a rest is given up."""
    robot.run(0.1)
    protocol = robot.protocol
    wanted = Frame(Kind.REPLY, QUESTION[protocol].address, b'\x64')
    return wanted in robot.ask(QUESTION[protocol])


@both
@settings(max_examples=40)
@given(chunks=st.lists(st.binary(max_size=80), max_size=20))
def test_any_bytes_are_survived(protocol: Protocol, chunks: list[bytes]) -> None:
    """Random bytes in random pieces end nothing: the next question is answered."""
    robot = VirtualRobot(*KINEMATIC, protocol=protocol)
    for chunk in chunks:
        robot.line.receive(chunk, robot.now)
        robot.run(0.002)
    assert answers(robot)


STATES = {Code.FEEDBACK, Code.FEEDBACK_RATE}  # would be taken for answers
PAYLOADS = st.tuples(
    st.integers(0, 2**16 - 1), st.booleans(), st.sampled_from([Kind.READ, Kind.WRITE]),
    st.binary(max_size=60),
)  # fmt: skip


@both
@settings(max_examples=60)
@given(frames=st.lists(PAYLOADS, min_size=5, max_size=5))
def test_any_frame_is_survived(
    protocol: Protocol, frames: list[tuple[int, bool, Kind, bytes]]
) -> None:
    """Valid frames with any address and payload end nothing and leave targets within limits."""
    robot = VirtualRobot(*KINEMATIC, protocol=protocol)
    known = sorted(protocol.functions.keys() - STATES)
    for number, is_known, kind, payload in frames:
        address = known[number % len(known)] if is_known else number
        address %= 256**protocol.address_size
        if address in STATES:
            continue
        robot.send(Frame(kind, address, payload))
        replies = robot.run(0.01)
        assert {frame.kind for frame in replies} <= ROBOT_KINDS
    robot.run(1.5)
    targets = robot.simulation.plant.joint_targets
    for joint, target in zip(LIMITS, targets, strict=True):
        assert math.isfinite(target)
        assert joint.limits.lower - 1e-9 <= target <= joint.limits.upper + 1e-9
    assert answers(robot)


@both
@given(cut=st.integers(1, 60))
@settings(max_examples=20)
def test_a_frame_may_come_in_any_two_pieces(protocol: Protocol, cut: int) -> None:
    """Pieces with a pause between them that is no silence make one frame."""
    robot = VirtualRobot(*KINEMATIC, protocol=protocol)
    data = QUESTION[protocol].encode(protocol)
    cut %= len(data)
    robot.line.receive(data[:cut], robot.now)
    robot.run(0.01)
    robot.line.receive(data[cut:], robot.now)
    assert len(robot.run(0.02)) == 1


@pytest.mark.parametrize(
    'address', [a for a, f in V1.functions.items() if Access.READ in f.access]
)
def test_every_register_that_can_be_read_has_as_many_bytes_as_were_asked_for(address: int) -> None:
    """The answer's length is that of the question, as the vendor's library relies on."""
    robot = VirtualRobot(*KINEMATIC, protocol=V1)
    for count in (1, V1.functions[address].length, 24):
        (answer,) = robot.ask(Frame(Kind.READ, address, bytes((count,))))
        assert (answer.kind, answer.address, len(answer.payload)) == (Kind.REPLY, address, count)


def test_any_number_of_bytes_may_be_asked_for() -> None:
    """None and more than a frame takes are not answered; everything between is."""
    robot = VirtualRobot(*KINEMATIC, protocol=V1)
    for count in (0, 1, 2, 24, 100, 246, 247, 248, 255):
        robot.send(Frame(Kind.READ, Register.BATTERY, bytes((count,))))
        assert [len(f.payload) for f in robot.run(0.03)] == ([count] if 0 < count <= 247 else [])


def test_the_old_protocol_may_run_at_another_speed() -> None:
    """A board that a program has switched to 2 Mbaud receives protocol v1 only there."""
    robot = VirtualRobot(*KINEMATIC, '--protocol', 'v1', '--v1-baud', '2000000', protocol=V1)
    assert robot.ask(QUESTION[V1]) == []
    robot.line.set_baud(2_000_000)
    assert answers(robot)


def test_a_write_runs_through_the_registers() -> None:
    """Three bytes at VX are VX, VY and VYAW; walking and bulk angles do not disturb each other."""
    robot = VirtualRobot(*KINEMATIC, protocol=V1)
    robot.ask(Frame(Kind.WRITE, Register.VX, bytes((255, 0, 128))))
    ahead, aside, turning = robot.simulation.board.walker.command
    assert ahead > 0 > aside
    assert turning == 0
    robot.ask(Frame(Kind.WRITE, Register.MOTORS, bytes([128] * 12)))
    assert not any(robot.simulation.board.walker.command)


def test_time_that_the_process_slept_through_is_not_made_up_for() -> None:
    """After a long pause the robot goes on from there, with one state and no burst of them."""
    robot = VirtualRobot(*KINEMATIC)
    robot.send(Frame(Kind.WRITE, Code.FEEDBACK, b'\x01'))
    robot.run(0.1)
    before = robot.simulation.plant.time
    robot.now += 100.0
    assert len(robot.run(0.1)) <= 7
    assert robot.simulation.plant.time - before <= MAX_LAG + 0.12


def test_the_rest_of_a_frame_is_not_waited_for() -> None:
    """Half a frame that promises twenty bytes holds no later one back."""
    robot = VirtualRobot(*KINEMATIC, protocol=V1)
    robot.line.receive(bytes.fromhex('55 00 14 00 50 80 80'), robot.now)
    robot.run(0.1)
    assert robot.ask(Frame(Kind.READ, Register.BATTERY, b'\x01'))[0].payload == bytes((100,))
