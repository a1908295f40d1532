# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Seven axes on trajectories and a walking quadruped for long: what is lost, what grows?

Run it with ``make soak``, or ``python tests/soak.py [--duration S]`` in the environment. The exit
code is the verdict. On a machine that others use, frames may be lost that we would not lose.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
import re
import sys
from tempfile import TemporaryDirectory
import threading
import time
from typing import TYPE_CHECKING

from control_msgs.action import FollowJointTrajectory
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from isolation import reserve
import numpy as np
import psutil
from simulated_arm import goal_to, JOINTS, MovingArm, READY, trajectory_client
from simulated_quad import SimulatedQuad

from canopen_core.can import open_bus
from canopen_core.standard import CobId
from quad_msgs.srv import InjectFault

if TYPE_CHECKING:
    from typing_extensions import Self

DURATION = 3600.0
"""In [s]."""
WARM_UP = 600.0
"""Time in [s] in which memory may grow; at most the first half of a shorter run."""
SAMPLING = 10.0
"""Time in [s] between two looks at the processes."""
LARGEST_SLOPE = 1.0
"""Growth of memory that counts as flat in [MB/h]."""
NOISE = 0.1
"""Growth in [MB] that is too little to count, as long as the run is short."""
MEGABYTE = 1e6
ANONYMOUS = re.compile(r'^Anonymous: +(\d+) kB$', re.MULTILINE)
FIRST_NODE = 2
WAY_TIME = 3.0
"""Of a trajectory in [s]."""
AWAY = [at + 0.4 for at in READY]
SLICE = 0.05
"""Time in [s] for which each robot's callbacks are served in turn."""
LOST, LATE = 'frames_lost', 'missed_pdos'
"""Counters of the master: frames that the kernel dropped, TPDOs that came after their cycle."""
TIMEOUT = 20.0
"""Longest time in [s] until it walks."""
CHARGING = 1200.0
"""Time in [s] between two full batteries of the quadruped; one lasts twice as long at a walk."""
AT_THE_END = 1
"""SYNCs whose answers may not be there yet."""


@dataclass(frozen=True)
class Sample:
    """What a process uses."""

    time: float  # on the steady clock in [s]
    memory: float  # of no file, in [MB]: who shares the pages of libraries changes meanwhile
    threads: int  # their number
    descriptors: int  # number of open files and sockets

    @classmethod
    def of(cls, process: psutil.Process) -> Sample:
        """Look at a process."""
        rollup = Path(f'/proc/{process.pid}/smaps_rollup').read_text()
        memory = int(ANONYMOUS.findall(rollup)[0]) * 1024 / MEGABYTE
        return cls(time.monotonic(), memory, process.num_threads(), process.num_fds())


@dataclass
class Usage:
    """What a process has used over time."""

    process: psutil.Process
    samples: list[Sample] = field(default_factory=list)

    def look(self) -> None:
        """Take a sample."""
        self.samples.append(Sample.of(self.process))

    def slope(self, warm_up: float) -> float:
        """Return the growth of memory in [MB/h] after a time in [s]."""
        begin = self.samples[0].time + warm_up
        late = [sample for sample in self.samples if sample.time >= begin]
        hours = [(sample.time - begin) / 3600.0 for sample in late]
        return float(np.polyfit(hours, [sample.memory for sample in late], 1)[0])


class FrameCount:
    """Counts the frames on a bus from outside."""

    def __init__(self, bus: str) -> None:
        self.counts: Counter[int] = Counter()
        self._bus = open_bus(bus)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def unanswered(self) -> int:
        """Return how many SYNCs some drive has not answered, of the drive with most of them."""
        syncs = self.counts[CobId.SYNC]
        nodes = range(FIRST_NODE, FIRST_NODE + len(JOINTS))
        missing = max(syncs - self.counts[CobId.TPDO1 + node] for node in nodes)
        return max(0, missing - AT_THE_END)

    @property
    def missed(self) -> int:
        """Frames that the count itself has lost."""
        return self._bus.counters.lost

    def _run(self) -> None:
        while not self._closing.is_set():
            self.counts.update(frame.can_id for frame in self._bus.receive(0.5))

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop counting."""
        self._closing.set()
        self._bus.wake()
        self._thread.join()
        self._bus.close()


class Robots:
    """Both, kept in motion."""

    def __init__(self, arm: MovingArm, quad: SimulatedQuad) -> None:
        self.arm, self.quad = arm, quad
        self.goals, self.failures = 0, list[str]()
        self._client = trajectory_client(arm.client)
        self._velocity = quad.client.node.create_publisher(Twist, '/cmd_vel', 1)
        self._reports = arm.client.listen(DiagnosticArray, '/diagnostics')
        assert self._client.wait_for_server(20.0)
        arm.follow()
        self._walk()
        self._charge_at = time.monotonic() + CHARGING
        self._away = False
        self._sent = self._client.send_goal_async(goal_to(READY, WAY_TIME))
        self._result = None

    def spin(self) -> None:
        """Serve both once, and go on where a motion has ended."""
        twist = Twist()
        twist.linear.x, twist.angular.z = 0.15, 0.5
        self._velocity.publish(twist)
        for client in (self.arm.client, self.quad.client):
            client.spin_for(SLICE)
        for messages in (self.quad.joints, self.quad.states, self.quad.truth, self._reports):
            del messages[:-1]
        self._continue()
        if time.monotonic() >= self._charge_at:
            self._charge_at += CHARGING
            self._charge()
        if self.quad.state != 'walk':
            for name, process in self.quad.processes.items():
                print(f'{name}: ' + '\n    '.join(process.lines[-5:]))
            self._failed(f'quadruped: {self.quad.processes["controller"].lines[-1]}')
            self._walk()

    def _failed(self, words: str) -> None:
        """Say it at once: what follows may keep the verdict from being reached."""
        print(time.strftime('%H:%M:%S'), words, flush=True)
        self.failures.append(words)

    def _charge(self) -> None:
        full = InjectFault.Request(fault='battery', settings=['level=100'], duration=1.0)
        answer = self.quad.client.call(InjectFault, '/fake_xgo/fault', full)
        if not answer.success:
            self._failed(f'quadruped: no battery: {answer.message}')

    def _walk(self) -> None:
        quad = self.quad
        if 'fault' in quad.state:
            quad.clear_fault()
        quad.stand()
        quad.set_mode('walk')
        quad.client.spin_until(lambda: quad.state == 'walk', TIMEOUT, 'walking')

    def _continue(self) -> None:
        if self._result is None:
            if self._sent.done():
                self._result = self._sent.result().get_result_async()
        elif self._result.done():
            result = self._result.result().result
            if result.error_code != FollowJointTrajectory.Result.SUCCESSFUL:
                self._failed(f'arm: {result.error_string}')
            self.goals += 1
            self._away = not self._away
            goal = goal_to(AWAY if self._away else READY, WAY_TIME)
            self._sent, self._result = self._client.send_goal_async(goal), None

    def bus_values(self) -> dict[str, int]:
        """Return the master's counters of what got lost."""
        for status in self._reports[-1].status:
            if status.name.endswith(': bus'):
                values = {entry.key: entry.value for entry in status.values}
                return {key: int(values[key]) for key in (LOST, LATE)}
        raise SystemExit('/diagnostics has no status of the bus')


def soak(duration: float, folder: Path) -> bool:
    """Run for a time in [s]; print the figures, and return whether all is well."""
    (folder / 'arm').mkdir()
    (folder / 'quad').mkdir()
    with (
        reserve() as one,
        reserve() as other,
        MovingArm(one, folder / 'arm') as arm,
        SimulatedQuad(other, folder / 'quad', tapped=False) as quad,
    ):
        robots = Robots(arm, quad)
        processes = {'master': arm.master, 'slaves': arm.slaves, **quad.processes}
        usages = {name: Usage(psutil.Process(p.pid)) for name, p in processes.items()}
        first: dict[str, int] = {}
        with FrameCount(one.bus) as frames:
            end = time.monotonic() + duration
            due = 0.0
            while time.monotonic() < end:
                robots.spin()
                if time.monotonic() >= due:
                    due = time.monotonic() + SAMPLING
                    for usage in usages.values():
                        usage.look()
                    first = first or robots.bus_values()
        last = robots.bus_values()
    print(f'TPDOs that came after their cycle: {last[LATE] - first[LATE]}')
    lost = {LOST: last[LOST] - first[LOST]}
    passed_over = syncs_passed_over(arm.slaves.output)
    print(f'SYNCs that the simulated devices passed over, without a processor: {passed_over}')
    lost |= {
        'unanswered SYNCs': max(0, frames.unanswered() - passed_over),
        "lost by this program's count": frames.missed,
    }
    return report(duration, robots, frames, usages, lost)


def syncs_passed_over(log: str) -> int:
    """Return how many SYNCs the simulated devices have not answered for want of a processor."""
    return sum(map(int, re.findall(r'(\d+) SYNC and \d+ other frames', log)))


def report(
    duration: float,
    robots: Robots,
    frames: FrameCount,
    usages: dict[str, Usage],
    lost: dict[str, int],
) -> bool:
    """Print the figures and the verdict; return whether all is well."""
    warm_up = min(WARM_UP, duration / 2)
    print(f'{duration:.0f} s, {frames.counts.total()} frames, {robots.goals} trajectories')
    print(*(f'{key}: {count}' for key, count in lost.items()), sep='\n')
    print(f'{"":12}{"MB at first":>14}{"at last":>10}{"MB/h":>8}{"threads":>14}{"files":>14}')
    bad = [f'{count} x {what}' for what, count in Counter(robots.failures).items()]
    for name, usage in usages.items():
        slope, samples = usage.slope(warm_up), usage.samples
        late = [s for s in samples if s.time >= samples[0].time + warm_up]
        settled, at_end = late[0], late[-1]
        half = max(len(late) // 2, 1)
        # the fewest of either half: while a goal runs the master has up to two threads more
        changes = {
            what: [min(getattr(s, what) for s in part) for part in (late[:half], late[-half:])]
            for what in ('threads', 'descriptors')
        }
        threads, descriptors = (f'{before} -> {after}' for before, after in changes.values())
        print(
            f'{name:12}{samples[0].memory:14.1f}{at_end.memory:10.1f}{slope:8.2f}'
            f'{threads:>14}{descriptors:>14}'
        )
        grown = slope * (at_end.time - settled.time) / 3600.0
        if slope > LARGEST_SLOPE and grown > NOISE:
            bad.append(f'{name}: memory grows by {slope:.2f} MB/h after {warm_up:.0f} s')
        bad += [
            f'{name}: {what} {before} -> {after}'
            for what, (before, after) in changes.items()
            if after > before
        ]
    bad += [f'{key}: {count}' for key, count in lost.items() if count]
    print('verdict: ' + ('; '.join(bad) or 'nothing lost, nothing grows'))
    return not bad


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--duration', type=float, default=DURATION, help='in s (default: 3600)')
    with TemporaryDirectory() as folder:
        sys.exit(not soak(parser.parse_args().duration, Path(folder)))


if __name__ == '__main__':
    main()
