# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demos of an arm: its drives wave; it is jogged and follows trajectories."""
