# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The quadruped as real processes, in figures: how it walks, and what its loop costs.

Run it with ``make bench``, or ``python tests/bench_quad.py [SECONDS]`` in the environment. Physics
runs beside it on the same machine, so the figures of the loop are those of a busy one.
"""

from __future__ import annotations

import bisect
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import itertools
import math
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from isolation import reserve
from nav_msgs.msg import Odometry
import psutil
from rclpy.qos import qos_profile_sensor_data
from simulated_quad import SimulatedQuad

from quad_bringup.demo.itinerary import Velocity
from quad_bringup.demo.report import velocity_text
from quad_bringup.demo.track import mean_velocity, Pose, Track

if TYPE_CHECKING:
    from processes import RunningProcess

SECONDS = 8.0
SETTLING = 1.5
"""Time in [s] after a new command that is not measured."""
PERIOD = 0.02
"""Period of the loop in [s]."""

VELOCITIES = (
    Velocity(forward=0.1),
    Velocity(forward=0.2),
    Velocity(forward=0.3),
    Velocity(forward=-0.1),
    Velocity(left=0.1),
    Velocity(turn=1.0),
    Velocity(forward=0.15, turn=0.6),
)


@dataclass(frozen=True, slots=True)
class Usage:
    """What a process used so far: processor time in [s], memory in [MB]."""

    processor: float
    memory: float


def usage(process: RunningProcess) -> Usage:
    """Ask the system."""
    system = psutil.Process(process.pid)
    times = system.cpu_times()
    return Usage(times.user + times.system, system.memory_info().rss / 1e6)


def poses(messages: Sequence[Odometry]) -> Track:
    """Follow the body through messages."""
    track = Track()
    for message in messages:
        stamp = message.header.stamp
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        rotation = (turn.x, turn.y, turn.z, turn.w)
        seconds = stamp.sec + 1e-9 * stamp.nanosec
        track.take(Pose(seconds, position.x, position.y, position.z, rotation))
    return track


def mean(messages: Sequence[Odometry]) -> Velocity | None:
    """Return the mean velocity of the body, in its own frame, over messages."""
    begin, end = poses(messages[:1]).milestone, poses(messages).milestone
    return None if begin is None or end is None else mean_velocity(begin, end)


def largest_tilt(messages: Sequence[Odometry]) -> float:
    """Return how far the body leaned in [rad]."""
    turns = [message.pose.pose.orientation for message in messages]
    return max(Pose(0, 0, 0, 0, (turn.x, turn.y, turn.z, turn.w)).tilt for turn in turns)


def percentile(values: Sequence[float], share: float) -> float:
    """Return a percentile; nan of nothing."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else math.nan


def latencies(reports: Sequence[float], commands: Sequence[float]) -> Iterator[float]:
    """Return for each command the time since the last report before it."""
    for command in commands:
        index = bisect.bisect(reports, command)
        if index:
            yield command - reports[index - 1]


def row(name: str, text: str) -> None:
    """Print a row."""
    print(f'  {name:<44} {text}', flush=True)


def walk(quad: SimulatedQuad, odometry: list[Odometry], velocity: Velocity, time: float) -> None:
    """Walk at a velocity and print what came of it."""
    quad.walk(SETTLING, velocity)
    truth_begin, odometry_begin = len(quad.truth), len(odometry)
    quad.walk(time, velocity)
    truth = quad.truth[truth_begin:]
    tilt = math.degrees(largest_tilt(truth))
    row(
        velocity_text(velocity),
        f'{velocity_text(mean(truth))}   {velocity_text(mean(odometry[odometry_begin:]))}   '
        f'{tilt:.1f}°',
    )


def print_loop(quad: SimulatedQuad, begin: dict[str, Usage], duration: float) -> None:
    """Print what the loop did and cost."""
    times = [target.time for target in quad.tap.targets]
    gaps = [after - before for before, after in itertools.pairwise(times)]
    jitter = [abs(gap - PERIOD) for gap in gaps]
    late = list(latencies(quad.tap.reports, times))
    row('commands on the wire', f'{len(gaps) / sum(gaps):.2f} Hz')
    for name, values in (('jitter of that', jitter), ('state frame to command on the wire', late)):
        p50, p99 = (1000 * percentile(values, share) for share in (0.5, 0.99))
        row(f'{name}, p50 / p99', f'{p50:.2f} / {p99:.2f} ms')
    row('largest step of a servo target', f'{quad.tap.largest_step():.2f}°')
    for name, process in quad.processes.items():
        now = usage(process)
        share = 100 * (now.processor - begin[name].processor) / duration
        row(f'{name}: processor, memory', f'{share:.1f} % of a core, {now.memory:.0f} MB')


def main() -> None:
    """Print everything."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    with (
        reserve() as isolation,
        TemporaryDirectory() as folder,
        SimulatedQuad(isolation, Path(folder)) as quad,
    ):
        odometry = quad.client.listen(Odometry, '/odom', qos_profile_sensor_data)
        quad.stand()
        quad.set_mode('walk')
        quad.tap.forget()
        begin = {name: usage(process) for name, process in quad.processes.items()}
        print('forward, left, turn: commanded, measured in physics, by /odom, largest tilt')
        for velocity in VELOCITIES:
            walk(quad, odometry, velocity, seconds)
        print('loop')
        print_loop(quad, begin, len(VELOCITIES) * (SETTLING + seconds))


if __name__ == '__main__':
    main()
