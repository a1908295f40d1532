# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Publishes numbered messages for the recording tests.

The number of messages and their period [s] are arguments; the first waits for the subscriptions.
After SIGUSR1 as many follow once more; SIGINT ends it.
"""

from __future__ import annotations

from itertools import count
import signal
import sys
import time

import rclpy
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from std_msgs.msg import String, UInt32

LATCHED = QoSProfile(  # type: ignore[no-untyped-call]
    depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL
)
BEST_EFFORT = QoSProfile(  # type: ignore[no-untyped-call]
    depth=100, reliability=QoSReliabilityPolicy.BEST_EFFORT
)


def main() -> None:
    """Publish, and print `published`."""
    length, period = int(sys.argv[1]), float(sys.argv[2])
    awaited = {signal.SIGUSR1, signal.SIGINT}
    signal.pthread_sigmask(signal.SIG_BLOCK, awaited)
    rclpy.init()
    node = Node('source')
    latched = node.create_publisher(String, 'latched', LATCHED)
    latched.publish(String(data='replaced'))
    latched.publish(String(data='kept'))
    numbers = node.create_publisher(UInt32, 'numbers', 100)
    loose = node.create_publisher(UInt32, 'loose', BEST_EFFORT)
    while not (numbers.get_subscription_count() and loose.get_subscription_count()):
        time.sleep(0.01)
    print('connected', flush=True)
    for number in count():
        numbers.publish(UInt32(data=number))
        loose.publish(UInt32(data=number))
        if signal.sigtimedwait({signal.SIGINT}, period) is not None:
            return
        if (number + 1) % length == 0:
            print('published', flush=True)
            if signal.sigwait(awaited) == signal.SIGINT:
                return


if __name__ == '__main__':
    main()
