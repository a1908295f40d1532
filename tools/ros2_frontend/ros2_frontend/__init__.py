# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The `ros2` command for a ROS 2 Jazzy that was installed from wheels.

Layers, each importing only what stands below it:

* ``verbs``: one module per group of commands; arguments in, text out
* ``ros``: the only place that touches rclpy: session, graph, discovery, QoS, calls
* ``index``: packages and interface definitions on disk
* ``messages``: messages to YAML and CSV, YAML to messages; pure
* ``cli``: the command tree, argument types, errors, suggestions; pure
"""
