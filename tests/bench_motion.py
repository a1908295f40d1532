# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arm motion as real processes, in figures, each beside what it has to reach.

Run it with ``make bench``, or ``python tests/bench_motion.py`` in the environment. On the bus are
seven simulated drives; what is measured was seen there, outside of the processes under test.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
import math
from pathlib import Path
from tempfile import TemporaryDirectory
import time
from typing import TYPE_CHECKING

from bench_axes import cpu_time, FIRST_NODE_ID, milliseconds
from bus_watch import BusRecorder
from control_msgs.msg import JointJog
from isolation import reserve
import numpy as np
from processes import executable, RunningProcess
from ros_client import RosClient
from sensor_msgs.msg import JointState
from simulated_arm import goal_to, JOINTS, MovingArm, READY, robot_parameters
from std_msgs.msg import Float64MultiArray

from arm_bringup.robots import expand_xacro, installed_robots_folder
from arm_model import Array, load_limits, RobotModel
from arm_servo import JogRequest, MotionCore, SetPoint, TwistCommand
from arm_servo.core.gateway import CommandGateway, start_worker
from arm_servo.motion_thread import (
    FollowingLimits,
    FollowingWatch,
    JointFeedback,
    MotionCycle,
    MotionThread,
)
from canopen_core.can import Frame
from canopen_core.standard import CobId
from realtime_loop import raise_priority

if TYPE_CHECKING:
    from isolation import Isolation

PERIODS = (10, 4)
"""SYNC periods in [ms]."""

SCALE = 1e-5
"""Of the drives in [rad] per increment."""

FAR = [0.6, -0.4, 0.4, -1.9, 0.4, 1.9, 1.2]
TRIALS = 25
SECONDS = 8.0
TARGET, ACTUAL = (0x200, slice(2, 6)), (0x280, slice(0, 4))
"""First identifier of the PDOs with the target and with the actual position, and where in them."""

Rows = list[tuple[str, str, str]]
"""Name, figure and reference of each row."""


def main() -> None:
    """Measure, and print the table."""
    for period in PERIODS:
        show(on_the_bus(period))
    show(servo_node(0.004))
    show(loop(0.002))


def show(rows: Rows) -> None:
    """Print rows."""
    for name, figure, reference in rows:
        print(f'{name:56}{figure:>20}   {reference}', flush=True)


def on_the_bus(period: int) -> Rows:
    """Measure motion_master with its drives."""
    with reserve() as isolation, TemporaryDirectory() as name:
        folder = Path(name)
        bus = fine_bus(folder, period)
        with BusRecorder(isolation.bus) as recorder, MovingArm(isolation, folder, bus=bus) as arm:
            arm.follow()
            ended(arm, READY, 3.0)
            begin = len(recorder.frames)
            ended(arm, FAR, 2.0)
            errors, later = tracking(Seen(recorder.frames[begin:]))
            delays, cpu = reaction(arm, recorder), jogging(arm)
    head = f'SYNC {period} ms: '
    cycles = [delay / period * 1e3 for delay in delays]
    half, most = np.percentile(cycles, [50, 95])
    middle, off = 1e3 * np.percentile(errors, [50, 99])
    return [
        (
            f'{head}trajectory tracking error p50 / p99',
            f'{middle:.3f} / {off:.3f} mrad',
            'below 1 mrad at 10 ms',
        ),
        (f'{head}set-point to measured position', f'{later} cycles', '2: the SYNCs between'),
        (
            f'{head}command to changed set-point p50 / p95',
            f'{half:.1f} / {most:.1f} cycles',
            'below 2; moveit_servo plans with 100 ms',
        ),
        (f'{head}the same', f'{milliseconds(delays, 0.5)} ms', ''),
        (f'{head}motion_master while jogging, of a core', f'{cpu:.1%}', 'the bus included'),
    ]


def fine_bus(folder: Path, period: int) -> Path:
    """Write a bus.yml of the Panda's joints with the drives of the GP110, which count finely."""
    robot = installed_robots_folder() / 'gp110'
    text = (robot / 'bus.yml').read_text(encoding='utf-8').partition('nodes:')[0]
    text = text.replace('sync_period: 10000', f'sync_period: {1000 * period}')
    text = text.replace('sub_index: 1, value: 10}', f'sub_index: 1, value: {period}}}')
    text = text.replace('"@BUS_CONFIG_PATH@"', f'"{robot}"')
    nodes = ''.join(
        f'  {joint}:\n    node_id: {node_id}\n'
        for node_id, joint in enumerate(JOINTS, start=FIRST_NODE_ID)
    )
    path = folder / 'bus.yml'
    path.write_text(f'{text}nodes:\n{nodes}')
    return path


def ended(arm: MovingArm, positions: Sequence[float], duration: float) -> None:
    """Carry a trajectory out."""
    result = arm.send(goal_to(positions, duration)).wait(60.0)[1]
    if result.error_code:
        raise SystemExit(result.error_string)


@dataclass(slots=True)
class Seen:
    """What the drives received and reported, cycle by cycle, in some frames."""

    frames: Sequence[Frame]

    def positions(self, pdo: tuple[int, slice]) -> Array:
        """Return the positions (cycles, joints) in [rad] of PDOs."""
        (first, place), rows = pdo, []
        row = [math.nan] * len(JOINTS)
        for frame in self.frames:
            if frame.can_id == CobId.SYNC:
                rows.append(list(row))
            joint = frame.can_id - first - FIRST_NODE_ID
            if 0 <= joint < len(JOINTS):
                row[joint] = SCALE * int.from_bytes(frame.data[place], 'little', signed=True)
        return np.array(rows)


def tracking(seen: Seen) -> tuple[Array, int]:
    """Return tracking errors in [rad], and the cycles from a set-point to its measurement.

    A position that is sent in a cycle is to be reached one SYNC after it was taken over; what is
    measured then is sent behind that SYNC. Cycles that come late on a busy computer are in it.
    """
    targets, actual = seen.positions(TARGET), seen.positions(ACTUAL)
    errors = {
        later: np.abs(actual[later:] - targets[:-later]).max(axis=1) for later in range(1, 5)
    }
    errors = {later: each[np.isfinite(each)] for later, each in errors.items()}
    best = min(errors, key=lambda later: float(np.median(errors[later][errors[later] > 0.0])))
    return errors[best], best


def reaction(arm: MovingArm, recorder: BusRecorder) -> list[float]:
    """Return times from the publishing of a jog to the PDO with another target in [s]."""
    node = arm.client.node
    publisher = node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 10)
    arm.client.spin_until(
        lambda: publisher.get_subscription_count() > 0, 10.0, 'subscription of the servo'
    )
    delays = []
    for trial in range(TRIALS):
        wait(arm.client, 0.6 + 0.0137 * (trial % 7))  # at rest, and at any time in the cycle
        known = last_target(recorder, len(recorder.frames))
        first, begin = len(recorder.frames), time.monotonic()
        sense = (-1.0) ** trial
        publisher.publish(JointJog(joint_names=JOINTS[:1], velocities=[sense], duration=0.1))
        found: list[float] = []

        def look(first: int = first, known: bytes = known, found: list[float] = found) -> bool:
            found[:] = [
                frame.timestamp
                for frame in recorder.frames[first:]
                if frame.can_id == TARGET[0] + FIRST_NODE_ID and frame.data[TARGET[1]] != known
            ][:1]
            return bool(found)

        arm.client.spin_until(look, 5.0, 'a changed set-point')
        delays.append(found[0] - begin)
    return delays


def last_target(recorder: BusRecorder, end: int) -> bytes:
    """Return the target of the first drive as it was sent last."""
    for frame in reversed(recorder.frames[:end]):
        if frame.can_id == TARGET[0] + FIRST_NODE_ID:
            return bytes(frame.data[TARGET[1]])
    raise SystemExit('no target was sent')


def jogging(arm: MovingArm) -> float:
    """Return the share of a core that motion_master takes while it jogs."""
    return busy_share(arm.client, arm.master)


def busy_share(client: RosClient, process: RunningProcess) -> float:
    """Jog a joint to and fro at 50 Hz; return the share of a core that a process takes."""
    publisher = client.node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 10)
    client.spin_until(lambda: publisher.get_subscription_count() > 0, 20.0, 'the servo')
    begin = time.monotonic()

    def jog() -> None:
        sense = 1.0 if (time.monotonic() - begin) % 2.0 < 1.0 else -1.0
        speeds = [0.4 * sense] * len(JOINTS)
        publisher.publish(JointJog(joint_names=JOINTS, velocities=speeds))

    timer = client.node.create_timer(0.02, jog)
    wait(client, 1.0)
    before, since = cpu_time(process), time.monotonic()
    wait(client, SECONDS)
    share = (cpu_time(process) - before) / (time.monotonic() - since)
    client.node.destroy_timer(timer)
    return share


def wait(client: RosClient, duration: float) -> None:
    """Spin for a time [s]."""
    end = time.monotonic() + duration
    client.spin_until(lambda: time.monotonic() >= end, duration + 5.0, 'the end')


def servo_node(period: float) -> Rows:
    """Measure servo_node, whose drives are elsewhere."""
    with reserve() as isolation, TemporaryDirectory() as folder:
        cpu = servo_share(isolation, Path(folder), period)
    name = f'servo_node at {1 / period:.0f} Hz while jogging, of a core'
    return [(name, f'{cpu:.1%}', 'below 25 %')]


def servo_share(isolation: Isolation, folder: Path, period: float) -> float:
    """Return the share of a core that servo_node takes while it jogs."""
    command = [
        *(executable('arm_servo', 'servo_node'), '--ros-args'),
        *('--params-file', str(robot_parameters(folder))),
        *('-p', f'moveit_servo.publish_period:={period}'),
        *('-p', 'moveit_servo.command_out_type:=std_msgs/Float64MultiArray'),
        *('-p', 'moveit_servo.publish_joint_velocities:=false'),
        *('-p', 'moveit_servo.command_out_topic:=/commands'),
    ]
    with (
        RosClient(isolation.domain_id) as client,
        RunningProcess(command, isolation.env) as process,
    ):
        at = list(READY)

        def take(message: Float64MultiArray) -> None:
            at[:] = message.data

        states = client.node.create_publisher(JointState, '/joint_states', 10)
        client.node.create_subscription(Float64MultiArray, '/commands', take, 10)
        client.node.create_timer(
            0.01, lambda: states.publish(JointState(name=JOINTS, position=at))
        )
        process.wait_until_ready()
        return busy_share(client, process)


def loop(period: float) -> Rows:
    """Measure how late the cycles of the motion thread begin and how long they take."""
    folder = installed_robots_folder() / 'panda'
    model = RobotModel(
        expand_xacro(folder / 'panda.urdf.xacro'),
        (folder / 'panda.srdf').read_text(encoding='utf-8'),
        load_limits(folder / 'limits.yaml'),
    )
    gateway = CommandGateway(MotionCore(model), start_worker())
    feedback = JointFeedback(model.joints, 1e9)
    feedback.receive(model.joints, READY, [0.0] * len(READY), time.monotonic())
    late: list[float] = []
    begin = [time.monotonic()]

    def put(point: SetPoint) -> None:
        feedback.receive(
            model.joints,
            point.state.position.tolist(),
            point.state.velocity.tolist(),
            time.monotonic(),
        )

    class Timed(MotionCycle):
        """A cycle that notes how late it begins."""

        def step(self, now: float, period: float) -> None:
            """Run a cycle."""
            late.append(time.monotonic() - now)
            super().step(now, period)

    watch = FollowingWatch(model.limits, FollowingLimits(), period)
    words: list[str] = []
    thread = MotionThread(
        Timed(gateway, feedback, put, watch),
        period,
        lambda: words.append(raise_priority(40, 'the loop').text),
    )
    thread.start()
    while time.monotonic() - begin[0] < SECONDS:
        sense = 1.0 if (time.monotonic() - begin[0]) % 2.0 < 1.0 else -1.0
        future = gateway.command(_jog(model, 0.1 * sense))
        future.add_done_callback(_raise)
        time.sleep(0.02)
    thread.stop()
    half, most, worst = 1e6 * np.percentile(late, [50, 99, 100])
    kind = words[0]
    return [
        (
            f'loop at {1 / period:.0f} Hz, late by p50 / p99 / max',
            f'{half:.0f} / {most:.0f} / {worst:.0f} us',
            f'below half a cycle; {kind}',
        )
    ]


def _jog(model: RobotModel, speed: float) -> JogRequest:
    command = TwistCommand(np.array([0.0, 0.0, speed, 0.0, 0.0, 0.0]))
    return JogRequest(command, time.monotonic() + 0.1)


def _raise(future: Future[None]) -> None:
    future.result()


if __name__ == '__main__':
    main()
