# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts MoveIt's messages to values of the core and back, and serves them on a node."""
