# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the robot does not report and the controller needs: rates, odometry, height."""

from .estimator import Estimator, EstimatorSettings, Health, RateSource
from .filters import Battery
from .imu_mounting import ImuMounting
from .odometry import OdometrySettings, OdometryState, SCALES
from .plausibility import BoardWatch

__all__ = [
    'SCALES',
    'Battery',
    'BoardWatch',
    'Estimator',
    'EstimatorSettings',
    'Health',
    'ImuMounting',
    'OdometrySettings',
    'OdometryState',
    'RateSource',
]
