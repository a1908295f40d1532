# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated robot in protocol v2: states pushed, functions carried out or refused."""

from __future__ import annotations

from itertools import pairwise
import math
from pathlib import Path
import struct
from types import SimpleNamespace

import numpy as np
import pytest
from sim_serial import Listener, serve, VirtualRobot

from quad_hardware.protocol import (
    Code,
    Frame,
    Kind,
    MOTOR_ORDER,
    Refusal,
    Register,
    slot_of,
    V1,
    V2,
)
from quad_pty_peer import read_state
from quad_sim.board import Overload, OVERLOAD_TIME

KINEMATIC = ('--physics', 'none', '--noise', 'none')
FEEDBACK_ON = Frame(Kind.WRITE, Code.FEEDBACK, b'\x01')
FEEDBACK_OFF = Frame(Kind.WRITE, Code.FEEDBACK, b'\x00')


def states(frames: list[Frame]) -> list[SimpleNamespace]:
    """Decode the states among frames."""
    return [read_state(frame) for frame in frames if frame.kind is Kind.PUSH]


def last_state(robot: VirtualRobot) -> SimpleNamespace:
    """Return a state that was measured from now on."""
    robot.send(FEEDBACK_ON)
    return states(robot.run(0.05))[-1]


def test_version_and_battery_are_reported() -> None:
    """Both answers have the address of the question and the payload of the table."""
    robot = VirtualRobot(*KINEMATIC, '--battery', '42', '--firmware', 'X-1.2')
    (version,) = robot.ask(Frame(Kind.READ, Code.VERSION))
    assert version == Frame(Kind.REPLY, Code.VERSION, b'X-1.2\0\0\0\0\0')
    (battery,) = robot.ask(Frame(Kind.READ, Code.BATTERY))
    assert battery == Frame(Kind.REPLY, Code.BATTERY, b'\x2a')


@pytest.mark.parametrize('rate', [None, 1, 20, 100])
def test_states_come_at_their_rate_and_in_sequence_until_they_are_switched_off(
    rate: int | None,
) -> None:
    """50 a second, or as set, of 254 bytes each; no gap; device time in milliseconds."""
    robot, period = VirtualRobot(*KINEMATIC), 1000 // (rate or 50)
    if rate is not None:
        robot.send(Frame(Kind.WRITE, Code.FEEDBACK_RATE, bytes((rate,))))
    assert robot.run(0.2) == []
    robot.send(FEEDBACK_ON)
    received = states(robot.run(3.0))
    assert len(received) == pytest.approx(3000 // period, abs=1)
    assert len(robot.received) == 254 * len(received)
    assert [state.sequence for state in received] == list(range(len(received)))
    steps = {b.device_time - a.device_time for a, b in pairwise(received)}
    assert steps <= {period - 1, period, period + 1}
    robot.send(FEEDBACK_OFF)
    robot.run(0.01)
    assert robot.run(0.5) == []
    assert len(robot.ask(Frame(Kind.READ, Code.VERSION))) == 1


def test_many_servos_go_where_one_frame_sends_them() -> None:
    """Angles in steps of 0.01 degrees arrive at the servos and come back in their slots."""
    robot = VirtualRobot(*KINEMATIC, '--arm')
    motors = MOTOR_ORDER
    angles = [2.5 * (slot % 5) - 5.0 for slot in range(len(motors))]
    payload = b''.join(
        V2.functions[Code.SERVOS].pack(motor=(motor,), angle=(angle,))
        for motor, angle in zip(motors, angles, strict=True)
    )
    robot.send(Frame(Kind.WRITE, Code.SERVOS, payload))
    robot.run(0.1)
    assert last_state(robot).position == pytest.approx(angles, abs=0.006)


def test_one_servo_goes_at_its_speed() -> None:
    """Speed 255 is at once; a low speed takes time and shows in the velocities."""
    robot = VirtualRobot(*KINEMATIC)
    robot.send(FEEDBACK_ON)
    move = V2.functions[Code.SERVO]
    robot.send(Frame(Kind.WRITE, Code.SERVO, move.pack(motor=(12,), angle=(20.0,))))
    assert states(robot.run(0.1))[-1].position[slot_of(12)] == pytest.approx(20.0, abs=0.01)
    robot.send(Frame(Kind.WRITE, Code.SPEED, bytes((12, 10))))
    robot.send(Frame(Kind.WRITE, Code.SERVO, move.pack(motor=(12,), angle=(40.0,))))
    under_way = states(robot.run(0.5))[-1]
    assert 25.0 < under_way.position[slot_of(12)] < 35.0
    assert under_way.velocity[slot_of(12)] == pytest.approx(10 / 255 * 527, rel=0.01)
    assert states(robot.run(1.0))[-1].position[slot_of(12)] == pytest.approx(40.0, abs=0.01)


def test_a_servo_that_is_mounted_otherwise_reads_otherwise() -> None:
    """Sign and offset act on angles, velocities and commands; the joint is where it was."""
    plain = last_state(VirtualRobot(*KINEMATIC, '--start', 'stand'))
    robot = VirtualRobot(*KINEMATIC, '--start', 'stand', '--mount', '12=-1,4.5')
    state = last_state(robot)
    slot = slot_of(12)
    assert state.position[slot] == pytest.approx(4.5 - plain.position[slot], abs=1e-3)
    assert state.position[slot + 1 :] == plain.position[slot + 1 :]
    move = V2.functions[Code.SERVO].pack(motor=(12,), angle=(4.5 - 30.0,))
    robot.send(Frame(Kind.WRITE, Code.SERVO, move))
    under_way = states(robot.run(0.02))
    assert all(state.velocity[slot] >= 0.0 for state in under_way)
    robot.run(0.1)
    thigh = robot.simulation.plant.joint_targets[1]
    assert math.degrees(thigh) == pytest.approx(30.0, abs=1e-3)


def test_torque_is_switched_by_motor_and_for_all() -> None:
    """0 lets go, 1 holds; FF means all."""
    robot = VirtualRobot(*KINEMATIC)
    servos = robot.simulation.board.servos
    for motor, on, loose in ((23, 0, [23]), (0xFF, 0, [*servos.fitted]), (0xFF, 1, [])):
        robot.ask(Frame(Kind.WRITE, Code.TORQUE, bytes((motor, on))))
        assert [m for m in servos.fitted if not servos.torque_on(m)] == loose


@pytest.mark.parametrize('sent', [False, True])
def test_a_servo_that_wakes_goes_to_its_last_target(*, sent: bool) -> None:
    """So a host sends it its position before it gives the torque back."""
    robot = VirtualRobot('--start', 'stand', '--noise', 'none', '--arm')
    servos = robot.simulation.board.servos
    robot.ask(Frame(Kind.WRITE, Code.FEEDBACK, b'\1'))
    standing = states(robot.run(0.3))[-1].position
    robot.ask(Frame(Kind.WRITE, Code.TORQUE, bytes((0xFF, 0))))
    sunk = states(robot.run(1.5))[-1].position
    assert max(abs(a - b) for a, b in zip(standing, sunk, strict=True)) > 15.0
    if sent:
        groups = (
            V2.functions[Code.SERVOS].pack(motor=(motor,), angle=(angle,))
            for motor, angle in zip(MOTOR_ORDER, sunk, strict=True)
        )
        robot.ask(Frame(Kind.WRITE, Code.SERVOS, b''.join(groups)))
    robot.ask(Frame(Kind.WRITE, Code.TORQUE, bytes((0xFF, 1))))
    assert all(map(servos.torque_on, servos.fitted))
    woken = states(robot.run(1.0))[-1].position
    expected = sunk if sent else standing
    assert woken == pytest.approx(expected, abs=6.0)


@pytest.mark.parametrize(
    ('frame', 'reason'),
    [
        (Frame(Kind.READ, 0x0305), Refusal.UNKNOWN_FUNCTION),
        (Frame(Kind.WRITE, 0x0305, b'\1'), Refusal.UNKNOWN_FUNCTION),
        (Frame(Kind.READ, Code.SERVO), Refusal.WRONG_ACCESS),
        (Frame(Kind.WRITE, Code.VERSION, b'\1'), Refusal.WRONG_ACCESS),
        (Frame(Kind.WRITE, Code.STATE, bytes(245)), Refusal.WRONG_ACCESS),
        (Frame(Kind.WRITE, Code.FEEDBACK, b'\1\1'), Refusal.WRONG_LENGTH),
        (Frame(Kind.WRITE, Code.SERVOS, b'\x0b\0'), Refusal.WRONG_LENGTH),
        (Frame(Kind.WRITE, Code.FEEDBACK, b'\7'), Refusal.WRONG_VALUE),
        (Frame(Kind.WRITE, Code.FEEDBACK_RATE, b'\0'), Refusal.WRONG_VALUE),
        (Frame(Kind.WRITE, Code.FEEDBACK_RATE, b'\xc8'), Refusal.WRONG_VALUE),
        (Frame(Kind.WRITE, Code.SERVO, struct.pack('<Bf', 14, 0.0)), Refusal.WRONG_VALUE),
        (Frame(Kind.WRITE, Code.SERVO, struct.pack('<Bf', 54, 0.0)), Refusal.WRONG_VALUE),
        (Frame(Kind.WRITE, Code.SERVO, struct.pack('<Bf', 12, math.nan)), Refusal.WRONG_VALUE),
        (Frame(Kind.WRITE, Code.SERVOS, b'\x0b\0\0\x63\0\0'), Refusal.WRONG_VALUE),
        (Frame(Kind.WRITE, Code.TORQUE, b'\x63\1'), Refusal.WRONG_VALUE),
    ],
)
def test_what_the_board_does_not_do_is_refused(frame: Frame, reason: Refusal) -> None:
    """A NACK with the address and the reason, and nothing has moved."""
    robot = VirtualRobot(*KINEMATIC)
    before = last_state(robot).position
    robot.ask(FEEDBACK_OFF)
    assert robot.ask(frame) == [Frame(Kind.NACK, frame.address, bytes((reason,)))]
    assert last_state(robot).position == before


def test_a_standing_robots_state_is_that_of_the_physics() -> None:
    """Attitude, specific force, servo angles, loads and battery have their sizes and units."""
    robot = VirtualRobot('--start', 'stand', '--noise', 'none', '--servo', 'firm')
    state = last_state(robot)
    assert state.euler2 == pytest.approx((0, 0, 0), abs=0.5)
    assert state.acceleration == pytest.approx((0, 0, 9.81), abs=0.1)
    for leg in (1, 2, 3, 4):
        calf, thigh, hip = (state.position[slot_of(10 * leg + digit)] for digit in (1, 2, 3))
        assert (hip, thigh, calf) == pytest.approx(
            (0, math.degrees(1.0), math.degrees(-0.2792)), abs=1.0
        )
        # the knee carries the robot
        assert 5.0 < abs(state.load[slot_of(10 * leg + 1)]) < 40.0
    assert state.position[12:] == (0.0,) * 4
    assert 7.5 < state.battery_voltage < 8.4
    assert state.battery == 100


@pytest.mark.slow
def test_heavy_load_drains_the_battery_and_warms_the_servos() -> None:
    """A minute of standing costs charge and warms the servos that carry the robot."""
    robot = VirtualRobot('--start', 'stand', '--noise', 'none')
    robot.simulation.board.advance(0.1)
    for second in range(1, 61):
        robot.simulation.board.advance(float(second))
        robot.simulation.board.advance(second + 0.45)
    robot.now = 61.0
    state = last_state(robot)
    assert robot.simulation.board.battery.charge < 99.9
    assert state.temperature[slot_of(11)] > state.temperature[slot_of(13)]


def test_a_landing_foot_is_no_overload() -> None:
    """Moments of full torque do not count, however often they come; a servo that is held does."""
    overload = Overload(2)
    for _ in range(100):
        overload.advance(np.array([1.0, 0.2]), 0.1)
        overload.advance(np.array([0.3, 1.0]), 0.1)
        assert not overload.lasts
    for _ in range(round(OVERLOAD_TIME / 0.1) + 2):
        overload.advance(np.array([1.0, 0.0]), 0.1)
    assert overload.lasts


def test_a_robot_of_one_protocol_is_deaf_at_the_other_speed() -> None:
    """At another baud rate nothing is understood, and at the right one everything again."""
    robot = VirtualRobot(*KINEMATIC, '--protocol', 'v1')
    assert robot.ask(Frame(Kind.READ, Code.VERSION)) == []
    assert robot.line.statistics.garbled > 0
    other = VirtualRobot(*KINEMATIC, '--protocol', 'v2', protocol=V1)
    assert other.ask(Frame(Kind.READ, Register.BATTERY, b'\1')) == []


def test_states_stay_away_from_a_host_that_went_on_to_the_other_speed() -> None:
    """After a probe of protocol v2 no state disturbs v1."""
    robot = VirtualRobot(*KINEMATIC)
    robot.send(FEEDBACK_ON)
    robot.run(0.1)
    robot.line.set_baud(V1.baud)
    robot.received = b''
    robot.run(0.2)
    assert robot.received == b''


def test_states_over_a_real_pseudo_terminal(tmp_path: Path) -> None:
    """A program that opens the port at 2 Mbaud gets whole frames, and none damaged."""
    with serve(tmp_path / 'xgo', *KINEMATIC) as served:
        listener = Listener(served.path)
        listener.send(FEEDBACK_ON)
        frames = listener.count(25)
        listener.close()
    assert [state.sequence for state in states(frames)] == list(range(25))
    assert listener.parser.counters.damaged == 0
    assert listener.parser.counters.skipped == 0
    # never faster than the board sends, over the whole of them
    assert listener.times[-1] - listener.times[0] > 0.8 * 24 * 0.02
