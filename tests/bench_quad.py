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
import os
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
import time
from typing import TYPE_CHECKING

from isolation import reserve
from nav_msgs.msg import Odometry
import psutil
from rclpy.qos import qos_profile_sensor_data
from simulated_quad import AHEAD, SimulatedQuad

from quad_bringup.walk import Track, velocity_text
from quad_controller import Velocity
from quad_description.rotations import tilt_of

if TYPE_CHECKING:
    from processes import RunningProcess

SECONDS = 8.0
SETTLING = 1.5
"""Time in [s] after a new command that is not measured."""
PERIOD = 0.02
"""Period of the loop in [s]."""

VELOCITIES = (
    Velocity(x=0.1),
    Velocity(x=0.2),
    Velocity(x=0.3),
    Velocity(x=-0.1),
    Velocity(y=0.1),
    Velocity(yaw=1.0),
    Velocity(x=0.15, yaw=0.6),
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


def mean(messages: Sequence[Odometry]) -> Velocity | None:
    """Return the mean velocity of the body, in its own frame, over messages."""
    track = Track()
    for message in messages[:1]:
        track.take(message)
    begin = track.stamp, track.way
    for message in messages[1:]:
        track.take(message)
    return track.mean_since(*begin)


def largest_tilt(messages: Sequence[Odometry]) -> float:
    """Return how far the body leaned in [rad]."""
    turns = [message.pose.pose.orientation for message in messages]
    return max(tilt_of((turn.x, turn.y, turn.z, turn.w)) for turn in turns)


def percentile(values: Sequence[float], share: float) -> float:
    """Return a percentile; nan of nothing."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else math.nan


def latencies(reports: Sequence[float], commands: Sequence[float]) -> Iterator[float]:
    """Return for each command the time since the last report before it."""
    for command in commands:
        index = bisect.bisect(reports, command)
        if index:
            yield command - reports[index - 1]


def row(name: str, text: str, goal: str = '') -> None:
    """Print a row."""
    print(f'  {name:<44} {text:<28} {goal}'.rstrip(), flush=True)


def walk(
    quad: SimulatedQuad, odometry: list[Odometry], velocity: Velocity, seconds: float
) -> None:
    """Walk at a velocity and print what came of it."""
    quad.walk(SETTLING, velocity)
    truth_begin, odometry_begin = len(quad.truth), len(odometry)
    quad.walk(seconds, velocity)
    truth = quad.truth[truth_begin:]
    tilt = math.degrees(largest_tilt(truth))
    row(
        velocity_text(velocity),
        f'{velocity_text(mean(truth))}   {velocity_text(mean(odometry[odometry_begin:]))}   '
        f'{tilt:.1f}°',
    )


def print_loop(quad: SimulatedQuad, begin: dict[str, Usage], duration: float) -> None:
    """Print what the loop did and cost, with what it shall."""
    times = [target.time for target in quad.tap.targets]
    late = list(latencies(quad.tap.reports, times))
    row('commands on the wire', f'{(len(times) - 1) / (times[-1] - times[0]):.2f} Hz')
    for name, values, goal in (
        ("jitter of the robot's states", jitter(quad.tap.reports), ''),
        ('jitter of the commands', jitter(times), 'p99 below 2 ms'),
        ('state frame to command on the wire', late, 'p50 below 3 ms'),
    ):
        p50, p99 = (1000 * percentile(values, share) for share in (0.5, 0.99))
        row(f'{name}, p50 / p99', f'{p50:.2f} / {p99:.2f} ms', goal)
    row('largest step of a servo target', f'{quad.tap.largest_step():.2f}°')
    shares = {}
    for name, process in quad.processes.items():
        now = usage(process)
        shares[name] = 100 * (now.processor - begin[name].processor) / duration
        memory = f'{shares[name]:.1f} % of a core, {now.memory:.0f} MB'
        row(f'{name}: processor, memory', memory, 'below 120 MB')
    both = shares['hardware'] + shares['controller']
    row('hardware and controller together', f'{both:.1f} % of a core', 'below 15 %')


def jitter(times: Sequence[float]) -> list[float]:
    """Return how far each interval is from the period in [s]."""
    return [abs(after - before - PERIOD) for before, after in itertools.pairwise(times)]


def go_ahead(quad: SimulatedQuad) -> bool:
    """Put everything before the other programs of this machine; return whether that is allowed.

    The robot and the tap come first: on a quiet machine nothing keeps them waiting.
    """
    threads = [(quad.tap.thread_id, 3)]
    for name, process in quad.processes.items():
        priority = 2 if name == 'fake_xgo' else 1
        threads += [(thread.id, priority) for thread in psutil.Process(process.pid).threads()]
    try:
        for thread, priority in threads:
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        return False
    return True


def measure_loop(quad: SimulatedQuad, seconds: float, title: str) -> None:
    """Walk, and print the loop."""
    quad.walk(SETTLING, AHEAD)
    quad.tap.forget()
    begin = {name: usage(process) for name, process in quad.processes.items()}
    start = time.monotonic()
    quad.walk(seconds, AHEAD)
    print(title)
    print_loop(quad, begin, time.monotonic() - start)


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
        print('forward, left, turn: commanded, measured in physics, by /odom, largest tilt')
        for velocity in VELOCITIES:
            walk(quad, odometry, velocity, seconds)
        measure_loop(quad, seconds, 'loop, 0.2 m/s, beside physics and what else runs here')
        if go_ahead(quad):
            measure_loop(
                quad, seconds, 'the same before all other programs, as on a quiet machine'
            )


if __name__ == '__main__':
    main()
