# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page on which a robot is seen and moved; nothing in here knows ROS.

Conventions: positions of joints are in [rad] or [m] by name, places in the root link in [m], times
on the steady clock in [s]; None hides what is shown, or says that it is unknown. What people do is
reported in threads of the server.
"""
