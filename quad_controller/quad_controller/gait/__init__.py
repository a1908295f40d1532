# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The geometric gait: body velocity to foot positions to joint positions."""
