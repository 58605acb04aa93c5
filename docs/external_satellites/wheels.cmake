# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
# Given to CMake as CMAKE_PROJECT_INCLUDE when a program is linked with the ROS of the PyPI wheels.
#
# librcl of the wheels needs the Python parts of some messages, and these need the symbols of a Python: the program
# is linked with libpython. The wheel of Fast DDS names a library of the container in which it was built, and has
# that library inside.
include_guard(GLOBAL)
include("${CMAKE_CURRENT_LIST_DIR}/../../ros_ws/ros_wheels_fix.cmake")

find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Embed)
set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)
add_link_options(-Wl,--no-as-needed)
link_libraries(Python3::Python)

function(satform_drop_container_libraries)
  get_property(targets DIRECTORY "${CMAKE_SOURCE_DIR}" PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(libraries ${target} INTERFACE_LINK_LIBRARIES)
    if(libraries MATCHES "/usr/lib64/libtinyxml2.so" AND NOT EXISTS "/usr/lib64/libtinyxml2.so")
      list(REMOVE_ITEM libraries "/usr/lib64/libtinyxml2.so")
      set_target_properties(${target} PROPERTIES INTERFACE_LINK_LIBRARIES "${libraries}")
    endif()
  endforeach()
endfunction()

cmake_language(DEFER DIRECTORY "${CMAKE_SOURCE_DIR}" CALL satform_drop_container_libraries)
