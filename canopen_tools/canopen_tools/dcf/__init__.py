# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A bus.yml as the files that a master built on Lely reads: master.dcf and concise DCFs."""
