# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""While a trajectory runs: the scaling of its speed, the way onto it, and its tolerances."""
