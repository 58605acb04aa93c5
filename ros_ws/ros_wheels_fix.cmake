# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
# Given to CMake as CMAKE_PROJECT_INCLUDE when ROS comes from the PyPI wheels.
#
# The wheels were built in a container whose Python stood under /opt/python, and their exported targets still name its
# folders as include directories. CMake refuses an imported target with an include directory that does not exist.
include_guard(GLOBAL)

function(satform_drop_container_includes)
  get_property(targets DIRECTORY "${CMAKE_SOURCE_DIR}" PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(directories ${target} INTERFACE_INCLUDE_DIRECTORIES)
    if(directories)
      list(FILTER directories EXCLUDE REGEX "^/opt/python/")
      set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${directories}")
    endif()
  endforeach()
endfunction()

# At the end of the top directory: only then have all packages been found and their targets imported.
cmake_language(DEFER DIRECTORY "${CMAKE_SOURCE_DIR}" CALL satform_drop_container_includes)
