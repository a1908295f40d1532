# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sets the environment up and builds the packages; standard library only.

Reads as: `cli` parses, `plan` decides which steps are due, `environment` and `build` carry them
out, and the other modules answer one question each (which ROS, which Python, what is missing,
what has changed).
"""
