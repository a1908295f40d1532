# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading what stands in the files: bus.yml with the place of each value, and EDS or DCF."""
