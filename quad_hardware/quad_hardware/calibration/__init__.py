# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Measures signs, offsets and limits of the joints, and the scale of the odometry."""
