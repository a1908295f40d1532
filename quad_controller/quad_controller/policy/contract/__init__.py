# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a policy expects and answers, as data: from files of training tools, or from YAML."""
