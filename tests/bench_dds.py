# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How long a publisher is held up, with our profile of Fast DDS and with its own transports.

Readers come one after the other while joint states go out at 500 Hz: what `ros2 topic echo` does
to a control cycle, since rclpy holds the interpreter while it publishes.

Run it with ``make bench``, or ``python tests/bench_dds.py [READERS]`` in the environment.
"""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import time

from isolation import reserve
import numpy as np
import rclpy
from sensor_msgs.msg import JointState

from dds_network import PROFILE_VARIABLE
from node_runner import make_executor

PERIOD = 0.002  # [s]
READERS = 8
BETWEEN = 0.3  # [s] from the start of a reader to that of the next
LIFE = 6.0  # [s] of a reader
END = 4.0  # [s] with the last reader
TOPIC = '/joint_states'


def main() -> None:
    """Measure both, and print the table."""
    readers = sys.argv[1] if len(sys.argv) > 1 else str(READERS)
    print(f'{readers} readers come; publishing at {1.0 / PERIOD:.0f} Hz takes [us]')
    print(f'{"":28}{"p50":>9}{"p99":>9}{"longest":>9}   CPU')
    for name in ('our profile', "Fast DDS's own transports"):
        with reserve() as isolation:
            env = dict(isolation.env)
            if name != 'our profile':
                del env[PROFILE_VARIABLE]
                env['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
            print(f'{name:28}', end='', flush=True)
            subprocess.run([sys.executable, __file__, 'publish', readers], env=env, check=True)


def publish(readers: int) -> None:
    """Publish while readers come, and print how long that took."""
    rclpy.init()
    publisher = rclpy.create_node('publisher').create_publisher(JointState, TOPIC, 10)
    angles = [0.1] * 12
    names = [f'panda_joint{number}' for number in range(1, 13)]
    message = JointState(name=names, position=angles, velocity=angles, effort=angles)
    processes: list[subprocess.Popen[bytes]] = []
    durations: list[float] = []
    start = time.monotonic()
    end = start + readers * BETWEEN + END
    for due in itertools.takewhile(lambda due: due < end, itertools.count(start, PERIOD)):
        if len(processes) < min(readers, 1 + (due - start) / BETWEEN):
            processes.append(subprocess.Popen([sys.executable, __file__, 'read'], env=os.environ))
        time.sleep(max(due - time.monotonic(), 0.0))
        before = time.perf_counter()
        publisher.publish(message)
        durations.append(time.perf_counter() - before)
    middle, high, longest = 1e6 * np.percentile(durations, [50, 99, 100])
    cpu = time.process_time() / (time.monotonic() - start)
    print(f'{middle:9.0f}{high:9.0f}{longest:9.0f}   {cpu:.1%}', flush=True)
    for process in processes:
        process.wait()


def read() -> None:
    """Receive for a while."""
    rclpy.init()
    node = rclpy.create_node(f'reader_{os.getpid()}')
    node.create_subscription(JointState, TOPIC, lambda _: None, 10)
    executor = make_executor()
    executor.add_node(node)
    end = time.monotonic() + LIFE
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)


if __name__ == '__main__':
    if sys.argv[1:2] == ['publish']:
        publish(int(sys.argv[2]))
    elif sys.argv[1:2] == ['read']:
        read()
    else:
        main()
