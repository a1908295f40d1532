# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Free motion: any path from start to goal that is valid; found, shortened, timed, checked."""
