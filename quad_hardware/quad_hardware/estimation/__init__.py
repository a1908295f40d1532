# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the robot does not report and the controller needs: rates, odometry, height."""

from .estimator import Estimator, EstimatorSettings, RateSource
from .filters import AttitudeRate, JointRate
from .imu_mounting import ImuMounting
from .odometry import OdometrySettings, SCALES
from .plausibility import BoardWatch

__all__ = [
    'SCALES',
    'AttitudeRate',
    'BoardWatch',
    'Estimator',
    'EstimatorSettings',
    'ImuMounting',
    'JointRate',
    'OdometrySettings',
    'RateSource',
]
