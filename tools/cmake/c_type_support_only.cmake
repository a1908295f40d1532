# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# Read into an interface package through CMAKE_PROJECT_INCLUDE where ROS comes from wheels. There is
# no C++ client library among the wheels, and rclpy loads the C type supports only, so the C++ ones
# are left out: that halves the build. Both are found here first, which registers the generators;
# the package's own find_package calls then change nothing.
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
list(FILTER AMENT_EXTENSIONS_rosidl_generate_idl_interfaces EXCLUDE REGEX "^[a-z_]+_cpp:")
