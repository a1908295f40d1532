# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Controllers of an arm behind one interface: jogging, trajectories, single targets."""
