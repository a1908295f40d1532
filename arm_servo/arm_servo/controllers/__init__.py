# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What moves an arm: jogging, a trajectory or a single target, each by one interface."""
