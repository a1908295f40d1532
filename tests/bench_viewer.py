# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page's share of a core with two pages open, and how soon after STOP the robot stands.

``python tests/bench_viewer.py FOLDER`` measures the page of another checkout in turn with this
one's. The pages are connections without a browser, so that figures of a busy machine compare.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, suppress
import os
from pathlib import Path
import sys
import threading
import time
from urllib.request import Request, urlopen

import browser
from control_msgs.msg import JointJog
from isolation import Isolation, reserve
import msgspec
import numpy as np
from processes import executable, RunningProcess
import psutil
from rclpy.publisher import Publisher
from ros_client import RosClient
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

CHECKOUT = Path(__file__).parents[1]
STARTING, SETTLING, LOOK = 150.0, 15.0, 10.0  # [s]
ROUNDS, STOPS = 2, 20
JOINT, SPEED, TURN_TIME = 'panda_joint7', 0.3, 2.0
"""What is jogged to and fro, at a share of its speed, and for how long one way in [s]."""
CAMERA = {
    'type': 'ViewerCameraMessage',
    'wxyz': (1.0, 0.0, 0.0, 0.0),
    'position': (1.0, 1.0, 1.0),
    'look_at': (0.0, 0.0, 0.0),
    'fov': 1.0,
    'near': 0.1,
    'far': 100.0,
    'image_height': 600,
    'image_width': 800,
    'up_direction': (0.0, 0.0, 1.0),
}
"""The first message of a page of viser."""


def open_page(url: str) -> list[ClientConnection]:
    """Connect as a page does, and read all that comes."""
    address = url.replace('http', 'ws')
    protocol = Subprotocol(f'viser-v{viser.__version__}')
    scene = connect(f'{address}/', max_size=None, subprotocols=[protocol])
    scene.send(msgspec.msgpack.encode(CAMERA))
    connections = [scene, connect(f'{address}/live', max_size=None)]

    def drain(connection: ClientConnection) -> None:
        with suppress(ConnectionClosed):
            while True:
                connection.recv()

    for connection in connections:
        threading.Thread(target=drain, args=[connection], daemon=True).start()
    return connections


def jog(client: RosClient, jogs: Publisher) -> None:
    """Command the joint once."""
    way = 1.0 if time.monotonic() % (2.0 * TURN_TIME) < TURN_TIME else -1.0
    message = JointJog(joint_names=[JOINT], velocities=[way * SPEED])
    message.header.stamp = client.node.get_clock().now().to_msg()
    jogs.publish(message)


def share(process: psutil.Process, client: RosClient, act: Callable[[], None]) -> float:
    """Return the share of a core that a process takes while something is done."""
    used, begin = sum(process.cpu_times()[:2]), time.monotonic()
    while time.monotonic() < begin + LOOK:
        act()
        client.spin_for(0.05)
    return (sum(process.cpu_times()[:2]) - used) / (time.monotonic() - begin)


def time_of_stop(url: str, client: RosClient, act: Callable[[], None]) -> float:
    """Request STOP in motion; return the time in [s] until the robot says that it stands."""
    for _ in range(20):
        act()
        client.spin_for(0.05)
    begin = time.monotonic()
    request = Request(f'{url}/stop', headers={'X-Robot-Stop': '1'})  # noqa: S310  # of here
    with urlopen(request) as answer:  # noqa: S310
        answer.read()
    return time.monotonic() - begin


def measure(folder: Path, isolation: Isolation, client: RosClient, jogs: Publisher) -> str:
    """Return the figures of the page of a checkout."""
    sources = ':'.join(map(str, [folder / 'robot_viewer', *folder.glob('libraries/*')]))
    path = f'{sources}:{isolation.env.get("PYTHONPATH", "")}'
    command = [executable('robot_viewer', 'web_viewer')]
    with RunningProcess(command, isolation.env | {'PYTHONPATH': path}) as viewer:
        url, process = browser.url_of(viewer, STARTING), psutil.Process(viewer.pid)
        pages = [open_page(url), open_page(url)]
        client.spin_for(SETTLING)
        rest = share(process, client, lambda: None)
        moving = share(process, client, lambda: jog(client, jogs))
        stops = [time_of_stop(url, client, lambda: jog(client, jogs)) for _ in range(STOPS)]
        for connection in (each for page in pages for each in page):
            connection.socket.close()
    p50, p99 = (1e3 * float(value) for value in np.percentile(stops, (50, 99)))
    return f'{rest:>8.1%}{moving:>8.1%}{p50:>8.0f} / {p99:.0f} ms'


def main() -> None:
    """Print the table."""
    folders = [*(Path(each).resolve() for each in sys.argv[1:]), CHECKOUT]
    print(f'{"page of":24}{"rest":>8}{"moving":>8}{"STOP p50 / p99":>18}{"load":>6}')
    robot = 'panda_hand', '--simulate', '--enable', '--plan', '--no-view'
    with ExitStack() as stack:
        isolation = stack.enter_context(reserve())
        words = [executable('arm_bringup', 'bringup'), *robot, '--can', isolation.bus]
        arm = stack.enter_context(RunningProcess(words, isolation.env))
        arm.wait_for('are enabled', STARTING)
        client = stack.enter_context(RosClient(isolation.domain_id))
        jogs = client.node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 1)
        for folder in folders * ROUNDS:
            figures = measure(folder, isolation, client, jogs)
            print(f'{folder.name:24}{figures:>34}{os.getloadavg()[0]:>6.0f}', flush=True)


if __name__ == '__main__':
    main()
