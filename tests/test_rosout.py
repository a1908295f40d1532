# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the layers without ROS log is read on /rosout, as everything else of a node."""

from __future__ import annotations

import os
from pathlib import Path
import signal
import sys

import failing_bus_master
from isolation import Isolation
from processes import RunningProcess
import pytest
from rcl_interfaces.msg import Log
from ros_client import LATCHED, RosClient
from simulated_arm import panda_bus

TIMEOUT = 60.0  # [s]


@pytest.mark.scenario
def test_a_bus_that_goes_down_is_a_message_of_the_master_on_rosout(isolation: Isolation) -> None:
    """The thread of the cycle logs it with Python's logging, and the master goes on.

    So it does after what a callback of another node of the program raises.
    """
    command = [
        sys.executable,
        str(Path(failing_bus_master.__file__)),
        '--ros-args',
        *('-p', f'bus_config:={panda_bus()}'),
        *('-p', f'can_interface_name:={isolation.bus}'),
    ]
    with (
        RosClient(isolation.domain_id) as client,
        RunningProcess(command, isolation.env) as master,
    ):
        # what the master logs at its start is received although the node is found later
        received: list[Log] = client.listen(Log, '/rosout', LATCHED)

        def of_master(level: int) -> list[str]:
            return [each.msg for each in received if each.name == 'master' and each.level == level]

        client.spin_until(lambda: bool(of_master(Log.INFO)), TIMEOUT, 'the master on /rosout')
        client.spin_until(lambda: bool(of_master(Log.ERROR)), TIMEOUT, 'the defect')
        client.spin_for(1.0)
        (defect,) = of_master(Log.ERROR)  # once
        assert failing_bus_master.DEFECT in defect
        os.kill(master.pid, signal.SIGUSR1)
        client.spin_until(
            lambda: failing_bus_master.DOWN in of_master(Log.ERROR), TIMEOUT, 'the failure'
        )
        assert master.is_running()
