# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Every fault does what it says, ends when it should, and repeats itself with its seed."""

from __future__ import annotations

import math
from pathlib import Path
import time

from hypothesis import given
from hypothesis import strategies as st
import pytest
import serial
from sim_serial import Listener, serve, TEST_TIMEOUT, VirtualRobot

from quad_hardware.protocol import Code, Fault, Frame, Kind, V2
from quad_pty_peer import read_state
from quad_sim import SetupError
from quad_sim.faults import Fault as LineFault
from quad_sim.faults import FaultKind, FaultPlan, make_fault, parse_fault
from quad_sim.robot_line import Wire

KINEMATIC = ('--physics', 'none', '--noise', 'none')
ON = Frame(Kind.WRITE, Code.FEEDBACK, b'\x01')
VERSION = Frame(Kind.READ, Code.VERSION)


def plain_wire(*faults: LineFault, seed: int = 0) -> Wire:
    """Return a wire on which some faults act."""
    return Wire(FaultPlan(faults), FaultKind.DEAF, seed, slow=True)


@given(st.lists(st.tuples(st.binary(min_size=1, max_size=60), st.floats(0, 0.01)), max_size=20))
def test_a_healthy_wire_delays_and_changes_nothing(chunks: list[tuple[bytes, float]]) -> None:
    """Bytes arrive in order, none earlier than the baud rate allows, none is lost."""
    wire, now, free, received = plain_wire(), 0.0, 0.0, b''
    for data, pause in chunks:
        now += pause
        wire.put(data, now, 115200)
        free = max(free, now) + len(data) * 10 / 115200
    arrivals = wire.take(1e9)
    received = b''.join(arrival.data for arrival in arrivals)
    assert received == b''.join(data for data, _ in chunks)
    if chunks:
        assert arrivals[-1].end == pytest.approx(free)


@given(st.binary(min_size=200, max_size=2000), st.integers(0, 5), st.floats(0, 1))
def test_damage_is_repeatable(data: bytes, seed: int, rate: float) -> None:
    """Equal seeds damage equal bytes, and lose about as many as the rate says."""

    def received(seed: int) -> bytes:
        wire = plain_wire(
            LineFault(FaultKind.DROP, values={'rate': rate}),
            LineFault(FaultKind.FLIP, values={'rate': rate}),
            seed=seed,
        )
        wire.put(data, 0.0, 115200)
        (arrival,) = wire.take(10.0)
        return arrival.data

    first = received(seed)
    assert received(seed) == first
    assert len(first) == pytest.approx((1.0 - rate) * len(data), abs=5.0 * math.sqrt(len(data)))


def test_a_flip_inverts_one_bit() -> None:
    """With rate one every byte differs from the original in exactly one bit."""
    wire = plain_wire(LineFault(FaultKind.FLIP, values={'rate': 1.0}))
    wire.put(bytes(range(256)), 0.0, 115200)
    (arrival,) = wire.take(1.0)
    assert all((a ^ b).bit_count() == 1 for a, b in zip(arrival.data, range(256), strict=True))


@pytest.mark.slow
def test_silence_begins_and_ends() -> None:
    """The robot receives and moves, and sends nothing, from one time to another."""
    robot = VirtualRobot(*KINEMATIC, '--fault', 'silence,at=1,for=0.5')
    robot.send(ON)
    assert len(robot.run(1.0)) >= 48
    robot.run(0.01)
    move = V2.functions[Code.SERVO].pack(motor=(12,), angle=(33.0,))
    robot.send(Frame(Kind.WRITE, Code.SERVO, move))
    assert robot.run(0.4) == []
    back = [read_state(frame) for frame in robot.run(0.3)]
    assert back
    assert back[0].sequence >= 70
    assert back[-1].position[1] == pytest.approx(33.0, abs=0.1)


def test_a_deaf_robot_goes_on_talking() -> None:
    """Questions get no answer while states keep coming."""
    robot = VirtualRobot(*KINEMATIC, '--fault', 'deaf,at=0.5')
    robot.send(ON)
    robot.run(0.6)
    robot.send(VERSION)
    frames = robot.run(0.3)
    assert {frame.kind for frame in frames} == {Kind.PUSH}


def test_a_slow_robot_answers_late() -> None:
    """Everything comes later by the delay, and nothing is lost."""
    robot = VirtualRobot(*KINEMATIC, '--fault', 'slow,delay=0.2')
    robot.send(VERSION)
    assert robot.run(0.19) == []
    assert len(robot.run(0.05)) == 1


def test_a_brown_out_forgets_everything_and_lets_go() -> None:
    """No byte while the supply is down; then it boots, holds, and has to be asked again."""
    robot = VirtualRobot(
        '--start', 'stand', '--noise', 'none', '--fault', 'brown_out,at=1,for=0.7'
    )
    robot.send(ON)
    robot.run(1.0)
    height = robot.simulation.plant.base_pose.position[2]
    assert robot.run(0.7) == []
    assert robot.simulation.plant.base_pose.position[2] < height - 0.015
    servos = robot.simulation.board.servos
    robot.run(0.1)
    assert all(map(servos.torque_on, servos.fitted))
    robot.send(VERSION)
    assert robot.run(0.3) == [], 'it still boots'
    robot.run(0.3)
    assert robot.run(0.2) == [], 'feedback is off'
    robot.send(ON)
    (first, *_) = robot.run(0.1)
    state = read_state(first)
    assert state.sequence == 0
    assert state.device_time < 2000
    # it lies where it fell
    assert robot.simulation.plant.base_pose.position[2] < height - 0.015


def test_an_empty_battery_is_reported() -> None:
    """The charge jumps, and the fault bit of the board says so."""
    robot = VirtualRobot(*KINEMATIC, '--fault', 'battery,at=0.5,level=7')
    robot.send(ON)
    before, *_, after = (read_state(frame) for frame in robot.run(1.0))
    assert (before.battery, after.battery) == (100, 7)
    assert not before.faults & Fault.LOW_BATTERY
    assert after.faults & Fault.LOW_BATTERY


def test_a_dead_imu_says_no_number_and_the_servos_follow() -> None:
    """The fault bit says so, angles go on, and a servo goes to its target."""
    robot = VirtualRobot(*KINEMATIC, '--fault', 'imu,at=0.5,for=1')
    robot.send(ON)
    before, *_, dead = (read_state(frame) for frame in robot.run(1.0))
    assert not before.faults & Fault.IMU
    assert all(map(math.isfinite, before.euler2))
    assert dead.faults & Fault.IMU
    assert all(map(math.isnan, dead.euler2))
    robot.send(
        Frame(Kind.WRITE, Code.SERVO, V2.functions[Code.SERVO].pack(motor=(11,), angle=(20.0,)))
    )
    *_, after = (read_state(frame) for frame in robot.run(1.0))
    assert after.position[0] == pytest.approx(20.0, abs=1.0)
    assert not after.faults & Fault.IMU


def test_a_limp_servo_gives_way_and_comes_back() -> None:
    """One servo lets go: the robot sinks there, the board says so; afterwards it holds again."""
    fault = 'limp,at=0.5,for=1,motor=11'
    still = '--start', 'stand', '--noise', 'none', '--servo', 'firm'
    robot = VirtualRobot(*still, '--fault', fault)
    robot.send(ON)
    servos = robot.simulation.board.servos
    before, *_, after = (read_state(frame) for frame in robot.run(1.4))
    assert [motor for motor in servos.fitted if not servos.torque_on(motor)] == [11]
    assert not before.faults & Fault.SERVO_SILENT
    assert after.faults & Fault.SERVO_SILENT
    assert abs(after.position[0] - before.position[0]) > 3.0
    assert abs(after.euler2[0]) > 0.3
    robot.send(Frame(Kind.WRITE, Code.TORQUE, b'\xff\x01'))
    robot.run(0.01)
    assert not servos.torque_on(11), 'no command repairs it'
    *_, last = (read_state(frame) for frame in robot.run(0.3))
    assert all(map(servos.torque_on, servos.fitted))
    assert not last.faults & Fault.SERVO_SILENT
    assert last.position[0] == pytest.approx(after.position[0], abs=1.0), 'it does not jump'


def test_faults_change_nothing_when_they_are_over() -> None:
    """A robot whose faults have ended says what one without faults says."""
    one = VirtualRobot(*KINEMATIC, '--fault', 'drop,rate=0.5,for=0.2', '--fault', 'flip,for=0.2')
    other = VirtualRobot(*KINEMATIC)
    for robot in (one, other):
        robot.run(0.3)
        robot.send(ON)
        robot.run(0.5)
    assert one.received == other.received


def test_the_same_bytes_at_the_same_times_have_the_same_answer() -> None:
    """With noise, physics and damage: two robots with one seed say the same, bit for bit."""

    def run(seed: str) -> bytes:
        robot = VirtualRobot('--seed', seed, '--fault', 'flip,rate=0.001', '--start', 'stand')
        robot.send(ON)
        robot.run(0.1)
        robot.send(ON)
        move = V2.functions[Code.SERVO].pack(motor=(12,), angle=(50.0,))
        for _ in range(5):
            robot.send(Frame(Kind.WRITE, Code.SERVO, move))
            robot.run(0.1)
        return robot.received

    assert run('1') == run('1')
    assert run('1') != run('2')


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('fire', "unknown fault 'fire'; there are drop, flip, silence, deaf, slow, brown_out"),
        ('drop,rate=2', 'rate 2.0 .* is not 0 to 1'),
        ('drop,rate=nan', 'rate nan'),
        ('drop,delay=1', "drop has no 'delay'; it takes at, for, rate"),
        ('silence,at=-1', 'at -1.0'),
        ('silence,for=0', 'for 0.0'),
        ('slow,delay', "'delay' is not name=number"),
    ],
)
def test_a_fault_without_sense_is_refused(text: str, message: str) -> None:
    """The message says what there is."""
    with pytest.raises(SetupError, match=message):
        parse_fault(text)


def test_an_unplugged_port_goes_and_comes_back(tmp_path: Path) -> None:
    """Who has it open sees a hang-up; the path comes back, and the robot has lived on."""
    with serve(tmp_path / 'xgo', *KINEMATIC) as served:
        listener = Listener(served.path)
        listener.send(ON)
        listener.count(5)
        now = served.server.now
        plan = served.simulation.line.faults
        served.do(lambda: plan.add(make_fault('unplug', [], now, 0.5)))
        with pytest.raises((serial.SerialException, OSError)):
            listener.until(lambda: False, 'hang-up')
        assert not served.path.exists()
        listener.close()
        deadline = time.monotonic() + TEST_TIMEOUT
        while not served.path.exists():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        again = Listener(served.path)
        (state, *_) = again.count(3)
        again.close()
    assert read_state(state).sequence > 5
