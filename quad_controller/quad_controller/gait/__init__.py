# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The geometric gait: from a velocity to the positions of four feet to joint positions."""
