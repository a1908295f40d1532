#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# rclpy 7.1.6 (Jazzy): while one coroutine awaits a future, the EventsExecutor never sleeps.
# Expected: it sleeps until the future is done, as SingleThreadedExecutor and asyncio do.
# Seen: spin_once(0.1) returns 10 times in an idle second, and tens of thousands of times while a coroutine waits,
# which takes a core; with SingleThreadedExecutor 10 and 21 times.
set -eu
unset PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet ros-jazzy-rclpy==7.1.6 ros-jazzy-rmw-fastrtps-cpp==8.4.3; } || exit 2
export ROS_DOMAIN_ID=83 ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ROS_LOG_DIR="$folder"
venv/bin/python -I - <<'END'
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.task import Future


def passes(executor):
    count, end = 0, time.monotonic() + 1.0
    while time.monotonic() < end:
        executor.spin_once(0.1)
        count += 1
    return count


rclpy.init()
seen = {}
for kind in (SingleThreadedExecutor, EventsExecutor):
    node, executor, future = rclpy.create_node('waiter'), kind(), Future()
    executor.add_node(node)

    async def wait(future=future):
        await future

    passes(executor)  # until the node has settled
    idle = passes(executor)
    task = executor.create_task(wait)
    waiting = passes(executor)
    future.set_result(None)
    executor.spin_once(0.1)
    print(f'{kind.__name__}: {idle} passes idle, {waiting} while a coroutine waits; it has ended: {task.done()}')
    seen[kind] = waiting / idle
raise SystemExit(not seen[SingleThreadedExecutor] < 10 < 100 < seen[EventsExecutor])
END
