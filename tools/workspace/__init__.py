# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sets up the environment and builds the packages; standard library only.

`cli` parses and its `plan` decides which steps are due, `environment` and `build` execute them,
and each other module answers one question (which ROS, which Python, what is missing, what has
changed).
"""
