# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An arm's drives and their master as real processes on a bus of their own."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
import time
from typing import TYPE_CHECKING

from ament_index_python.packages import get_package_share_directory
from processes import executable, RunningProcess
from ros_client import RosClient
from std_srvs.srv import Trigger

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

    from isolation import Isolation
    from typing_extensions import Self

JOINTS = [f'panda_joint{number}' for number in range(1, 8)]


def panda_bus() -> Path:
    """Return the bus.yml of the installed robot."""
    return Path(get_package_share_directory('arm_bringup')) / 'robots' / 'panda' / 'bus.yml'


class SimulatedArm:
    """Slaves, master and a client; by default the Panda's.

    Attributes:
        joints: Names of the drives.
        slaves: Process of the simulated drives.
        master: Process of the master.
        client: A ROS node of the test.
    """

    def __init__(
        self,
        isolation: Isolation,
        bus_config: Path | None = None,
        joints: Sequence[str] = JOINTS,
        master_arguments: Sequence[str] = (),
    ) -> None:
        self.joints = list(joints)
        self._isolation = isolation
        self._bus_config = bus_config or panda_bus()
        self._stack = ExitStack()
        try:
            self.client = self._stack.enter_context(RosClient(isolation.domain_id))
            self.slaves = self.start('fake_slaves')
            self.master = self.start('master', *master_arguments)
            self.master.wait_until_ready()
        except BaseException:
            self._stack.close()
            raise

    def start(self, name: str, *arguments: str) -> RunningProcess:
        """Start an executable of arm_canopen on the bus; it ends with the arm."""
        command = [
            executable('arm_canopen', name),
            '--ros-args',
            *('-p', f'bus_config:={self._bus_config}'),
            *('-p', f'can_interface_name:={self._isolation.bus}'),
            *arguments,
        ]
        return self._stack.enter_context(RunningProcess(command, self._isolation.env))

    def run(self, *command: str) -> RunningProcess:
        """Start any command in the environment of the arm, as from a second terminal."""
        return self._stack.enter_context(RunningProcess(command, self._isolation.env))

    def init_all(self) -> float:
        """Initialise all joints at the same time; return how long that took in [s]."""
        clients = [self.client.client_of(Trigger, f'/{joint}/init', 20.0) for joint in self.joints]
        begin = time.monotonic()
        futures = [client.call_async(Trigger.Request()) for client in clients]
        self.client.spin_until(lambda: all(f.done() for f in futures), 20.0, 'init of all joints')
        duration = time.monotonic() - begin
        for future in futures:
            assert future.result().success, future.result().message
        return duration

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Stop all processes, the last started first."""
        self._stack.close()
