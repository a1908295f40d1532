# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging: twists, poses and joint speeds become joint velocities (a quadratic program)."""
