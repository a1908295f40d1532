# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The serial line of the robot: time, faults, pseudo-terminal, and the loop that serves it."""
