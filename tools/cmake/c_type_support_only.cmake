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

# Several files in one translation unit: most of the time goes into reading the same headers. Those
# that describe types define the same static names, and stay alone.
function(_compile_together)
  foreach(part rosidl_generator_c rosidl_generator_py rosidl_typesupport_c
      rosidl_typesupport_fastrtps_c rosidl_typesupport_introspection_c)
    set(target ${PROJECT_NAME}__${part})
    if(TARGET ${target})
      set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 16)
      get_target_property(sources ${target} SOURCES)
      list(FILTER sources INCLUDE REGEX "__description\\.c$")
      set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
endfunction()
cmake_language(DEFER CALL _compile_together)
