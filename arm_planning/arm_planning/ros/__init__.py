# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""MoveIt's messages to values of the core and back, and what a node does with them."""
