# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A process supervisor: starts processes, waits until they are ready, stops them in order.

:mod:`.supervision` decides, without processes, clock or signal handlers: it receives timed events,
and acts through callables. :mod:`.runner` applies it to real processes, which :mod:`.fork_server`
starts faster; :mod:`.guardian` stops them in order even if the runner was killed.

Further modules serve the bring-ups of all robots: :mod:`.nodes` finds the executables of ROS
packages and prevents a second bring-up, :mod:`.ros_options` parses shared arguments,
:mod:`.terminal` shows the output of the processes.
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
