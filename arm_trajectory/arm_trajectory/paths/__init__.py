# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Before a trajectory begins: points become a path, with its corners and its time scaled."""
