# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A process supervisor: starts processes, waits until they are ready, stops them in order.

The decisions are in :mod:`.supervision`, which knows no process, no clock and no signal handler:
it gets what happened and when, and acts through callables. :mod:`.runner` does it with real
processes, which :mod:`.fork_server` starts in less time; :mod:`.guardian` stops them in order,
also when the runner was killed.

Around it stands what the bring-ups of all robots need: :mod:`.nodes` finds the executables of ROS
packages and keeps a second bring-up away, :mod:`.ros_options` reads the arguments that all share,
:mod:`.terminal` shows what the processes write.
"""

from .fork_server import ForkServer
from .nodes import (
    add_view,
    bring_up_place,
    EVERY_NODE,
    exclusive,
    Executable,
    find_executable,
    FindExecutable,
    namespaced_parameters,
    node_argv,
    node_process,
    parameters_by_node,
    ros_domain,
    state_publisher,
    STATE_PUBLISHERS,
    view_process,
    VIEWER,
    write_parameters,
)
from .ros_options import add_namespace, parse_with_ros, RosOptions, split_ros_arguments
from .runner import Runner
from .spec import (
    CallError,
    GivenUpError,
    ProcessSpec,
    ServiceManager,
    StartError,
    StopStep,
    SupervisorError,
)
from .supervision import Notice, Outcome, Phase, Severity, Supervision
from .terminal import (
    join_in_time,
    LineWriter,
    Painter,
    severity_of,
    Shutdown,
    supervise,
    USAGE_ERROR,
    wants_colour,
)

__all__ = [
    'EVERY_NODE',
    'STATE_PUBLISHERS',
    'USAGE_ERROR',
    'VIEWER',
    'CallError',
    'Executable',
    'FindExecutable',
    'ForkServer',
    'GivenUpError',
    'LineWriter',
    'Notice',
    'Outcome',
    'Painter',
    'Phase',
    'ProcessSpec',
    'RosOptions',
    'Runner',
    'ServiceManager',
    'Severity',
    'Shutdown',
    'StartError',
    'StopStep',
    'Supervision',
    'SupervisorError',
    'add_namespace',
    'add_view',
    'bring_up_place',
    'exclusive',
    'find_executable',
    'join_in_time',
    'namespaced_parameters',
    'node_argv',
    'node_process',
    'parameters_by_node',
    'parse_with_ros',
    'ros_domain',
    'severity_of',
    'split_ros_arguments',
    'state_publisher',
    'supervise',
    'view_process',
    'wants_colour',
    'write_parameters',
]
