# Language, warnings, instruction set and sanitizers: what every target of the project shares.
option(DIORAMA_BUILD_TESTS "Build the tests" ON)
option(DIORAMA_BUILD_BENCH "Build the benchmarks" ON)
set(DIORAMA_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize= (address,undefined or thread)")
set(DIORAMA_ARCH "" CACHE STRING "Value for -march; empty: x86-64-v3 on x86-64, the compiler's default elsewhere")

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

find_program(DIORAMA_CCACHE ccache)
if(DIORAMA_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${DIORAMA_CCACHE}")
endif()

# The instruction set decides the alignment of Eigen's types, so it is part of the libraries' interface.
add_library(diorama_settings INTERFACE)
add_library(diorama::settings ALIAS diorama_settings)
set_target_properties(diorama_settings PROPERTIES EXPORT_NAME settings)
target_compile_features(diorama_settings INTERFACE cxx_std_20)
if(NOT DIORAMA_ARCH AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(DIORAMA_ARCH x86-64-v3)
endif()
if(DIORAMA_ARCH)
  target_compile_options(diorama_settings INTERFACE -march=${DIORAMA_ARCH})
endif()

add_library(diorama_warnings INTERFACE)
target_compile_options(diorama_warnings INTERFACE -Wall -Wextra -Wconversion -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(diorama_warnings INTERFACE -Wno-restrict -Wno-array-bounds)  # false alarms on string + string and in Eigen
endif()
if(DIORAMA_SANITIZE)
  add_compile_options(-fsanitize=${DIORAMA_SANITIZE} -fno-omit-frame-pointer -g)
  target_compile_options(diorama_warnings INTERFACE -Wno-maybe-uninitialized)  # false alarms in <functional> and <regex>
  add_link_options(-fsanitize=${DIORAMA_SANITIZE})
endif()
