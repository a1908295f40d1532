# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page that shows and moves a robot; independent of ROS.

Conventions: joint positions are in [rad] or [m] by name, points in the root link in [m], times on
the steady clock in [s]; None hides an element or means unknown. Callbacks for user input run in
threads of the server.
"""
