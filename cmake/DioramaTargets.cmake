# diorama_library(NAME [DEPENDS ...] [PRIVATE ...]): the library diorama::NAME from the sources of this folder.
# DEPENDS is seen by its users (headers), PRIVATE is not.
function(diorama_library name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;PRIVATE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS "*.cpp")
  if(NOT sources)  # a folder that is still empty
    add_library(diorama_${name} INTERFACE)
    add_library(diorama::${name} ALIAS diorama_${name})
    target_link_libraries(diorama_${name} INTERFACE ${ARG_DEPENDS})
    return()
  endif()
  add_library(diorama_${name} ${sources})
  add_library(diorama::${name} ALIAS diorama_${name})
  target_include_directories(diorama_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/diorama>)
  target_link_libraries(diorama_${name}
    PUBLIC diorama::settings ${ARG_DEPENDS}
    PRIVATE $<BUILD_INTERFACE:diorama_warnings> ${ARG_PRIVATE})
  set_target_properties(diorama_${name} PROPERTIES EXPORT_NAME ${name})
  set_property(GLOBAL APPEND PROPERTY DIORAMA_LIBRARIES diorama_${name})
  file(GLOB headers "*.h")
  install(FILES ${headers} DESTINATION include/diorama/${name})
endfunction()

# diorama_test(NAME LABEL labels... [DEPENDS ...]): the test program NAME from the *_test.cpp of this folder.
function(diorama_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "LABEL;DEPENDS;SOURCES" ${ARGN})
  if(NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS "*_test.cpp")
  endif()
  if(NOT ARG_SOURCES)
    return()
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} diorama_warnings GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE
    DIORAMA_SOURCE_DIR="${PROJECT_SOURCE_DIR}" DIORAMA_BINARY="$<TARGET_FILE_DIR:diorama_core>/../diorama")
  gtest_discover_tests(${name} PROPERTIES LABELS "${ARG_LABEL}" TIMEOUT ${ARG_TIMEOUT} DISCOVERY_TIMEOUT 60)
endfunction()

# Installs the libraries and a package file, so that find_package(diorama) gives diorama::core, diorama::sim, ...
function(diorama_install)
  include(CMakePackageConfigHelpers)
  get_property(libraries GLOBAL PROPERTY DIORAMA_LIBRARIES)
  install(TARGETS diorama_settings ${libraries} EXPORT diorama ARCHIVE DESTINATION lib LIBRARY DESTINATION lib)
  install(EXPORT diorama NAMESPACE diorama:: DESTINATION lib/cmake/diorama FILE dioramaTargets.cmake)
  configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/dioramaConfig.cmake.in"
    "${PROJECT_BINARY_DIR}/dioramaConfig.cmake" INSTALL_DESTINATION lib/cmake/diorama)
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/dioramaConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
  install(FILES "${PROJECT_BINARY_DIR}/dioramaConfig.cmake" "${PROJECT_BINARY_DIR}/dioramaConfigVersion.cmake"
    DESTINATION lib/cmake/diorama)
endfunction()
