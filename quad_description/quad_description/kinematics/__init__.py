# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Kinematics of the quadruped: geometry of a leg, forward, inverse, Jacobian, whole robot."""
