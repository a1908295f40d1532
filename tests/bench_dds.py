# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How long a publisher is held up, with our profile of Fast DDS and with its own transports.

Joint states go out at 500 Hz, while readers come one after the other, as `ros2 topic echo` does,
and to a reader of another host over a slow link. rclpy holds the interpreter while it publishes:
a control cycle of the process waits as long.

Run it with ``make bench``, or ``python tests/bench_dds.py`` in the environment.
"""

from __future__ import annotations

from contextlib import suppress
import os
import subprocess
import sys
import time

from isolation import Isolation, reserve
from network_hosts import two_hosts
import numpy as np
import pytest
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.utilities import ok
from sensor_msgs.msg import JointState

from dds_network import NETWORK_VARIABLE, PROFILE_VARIABLE, restrict_dds
from node_runner import make_executor

PERIOD = 0.002  # [s]
DURATION = 8.0  # [s]
READERS = 8
BETWEEN = 0.3  # [s] from the start of a reader to that of the next
MATCH_TIME = 20.0  # [s]
TOPIC = '/joint_states'
SLOW = ['root', 'tbf', 'rate', '400kbit', 'burst', '3000', 'limit', '20000000']
"""A link as a token bucket filter of tc; with the deep queue of a radio."""


def main() -> None:
    """Measure both, and print the table."""
    print(f'publishing at {1.0 / PERIOD:.0f} Hz takes [us]{"p50":>24}{"p99":>9}{"longest":>10}')
    for own in (True, False):
        here(own=own)
    try:
        for own in (True, False):
            over_a_slow_link(own=own)
    except pytest.skip.Exception as reason:
        print(reason)


def here(*, own: bool) -> None:
    """Let readers of this host come."""
    with reserve() as isolation:
        command = [sys.executable, __file__, 'publish']
        report(f'{READERS} readers come', command, environment(isolation, '', own=own), own=own)


def over_a_slow_link(*, own: bool) -> None:
    """Let one of another host read."""
    with reserve() as isolation, two_hosts() as (robot, desk):
        read = desk.command([sys.executable, __file__, 'read'])
        command = robot.command([sys.executable, __file__, 'publish', robot.interface])
        with subprocess.Popen(read, env=environment(isolation, desk.address, own=own)) as reader:
            try:
                env = environment(isolation, robot.address, own=own)
                report('a reader over 400 kbit/s', command, env, own=own)
            finally:
                reader.terminate()


def environment(isolation: Isolation, address: str, *, own: bool) -> dict[str, str]:
    """Return that of a process, whose host has an address beside loopback."""
    env = isolation.env
    if not own:
        del env[PROFILE_VARIABLE]
        env['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET' if address else 'LOCALHOST'
    elif address:
        env[NETWORK_VARIABLE] = address
    return env


def report(what: str, command: list[str], env: dict[str, str], *, own: bool) -> None:
    """Run a publisher, and print the row that it measures."""
    transports = 'our profile' if own else "Fast DDS's own"
    print(f'{what + ", " + transports:42}', end='', flush=True)
    subprocess.run(command, env=env, check=True)


def publish(interface: str) -> None:
    """Publish, and print how long that took.

    Args:
        interface: Is made slow as soon as there is a reader; empty for readers of this host,
            which are started one after the other.
    """
    node = Node('publisher')
    publisher = node.create_publisher(JointState, TOPIC, 10)
    if interface:
        deadline = time.monotonic() + MATCH_TIME
        while not publisher.get_subscription_count():
            if time.monotonic() > deadline:
                sys.exit('there is no reader')
            time.sleep(0.05)
        subprocess.run(['tc', 'qdisc', 'add', 'dev', interface, *SLOW], check=True)
    angles = [0.1] * 7
    names = [f'panda_joint{number}' for number in range(1, 8)]
    message = JointState(name=names, position=angles, velocity=angles, effort=angles)
    readers: list[subprocess.Popen[bytes]] = []
    durations: list[float] = []
    start = due = time.monotonic()
    while due < start + DURATION:
        if not interface and len(readers) < min(READERS, (due - start) / BETWEEN):
            readers.append(subprocess.Popen([sys.executable, __file__, 'read']))
        time.sleep(max(due - time.monotonic(), 0.0))
        before = time.monotonic()
        publisher.publish(message)
        now = time.monotonic()
        durations.append(now - before)
        due = max(due + PERIOD, now)
    middle, high, longest = 1e6 * np.percentile(durations, [50, 99, 100])
    print(f'{middle:9.0f}{high:9.0f}{longest:10.0f}', flush=True)
    for reader in readers:
        reader.terminate()
        reader.wait()
    os._exit(0)  # what is left in the queues of a slow link is of no interest


def read() -> None:
    """Receive until the end."""
    node = Node('reader')
    node.create_subscription(JointState, TOPIC, lambda _: None, 10)
    executor = make_executor()
    executor.add_node(node)
    with suppress(ExternalShutdownException):
        while ok():
            executor.spin_once(0.1)


if __name__ == '__main__':
    if sys.argv[1:]:
        if PROFILE_VARIABLE in os.environ:
            restrict_dds(os.environ)
        rclpy.init()
    if sys.argv[1:2] == ['publish']:
        publish(''.join(sys.argv[2:]))
    elif sys.argv[1:2] == ['read']:
        read()
    else:
        main()
