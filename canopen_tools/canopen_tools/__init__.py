# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The `canopen` command, `candump` in words, EDS lint, DCF export, LSS; without ROS."""
