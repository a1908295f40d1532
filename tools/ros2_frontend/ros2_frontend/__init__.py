# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The `ros2` command for a ROS 2 Jazzy installation from wheels.

Layers; each imports only those below it:

* ``verbs``: one module per group of commands; arguments in, text out * ``ros``: the only place
that touches rclpy: session, graph, QoS, calls, recorder, player * ``bag``: decisions and output of
``ros2 bag``; pure * ``index``: packages and interface definitions on disk * ``messages``: messages
to YAML and CSV, YAML to messages; pure * ``cli``: the command tree, argument types, errors,
suggestions; pure
"""

import os
import sys

LIBRARIES = (
    f'{os.path.realpath(__file__).rsplit(os.sep, 4)[0]}/libraries'  # pathlib: 5 ms of a start
)

# of this checkout; they need not be built, as `ros2` itself need not be
for _library in ('recording', 'ros_runtime'):
    sys.path.append(f'{LIBRARIES}/{_library}')
