# Compiler settings and the three functions by which every folder declares what it builds.
include(GNUInstallDirs)
# One component for each package (UnderstoryPackages.cmake): dev where an install() names none.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME dev)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  # Relative paths in the cache key: another checkout of the same source hits the same cache.
  # The sloppiness is what ccache asks for before it takes files with a precompiled header.
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env "CCACHE_BASEDIR=${CMAKE_SOURCE_DIR}" CCACHE_NOHASHDIR=1
      "CCACHE_SLOPPINESS=pch_defines,time_macros" "${CCACHE_PROGRAM}")
endif()

add_library(understory_flags INTERFACE)
target_compile_options(understory_flags INTERFACE -Wall -Wextra -Wpedantic
                       $<$<BOOL:${UNDERSTORY_WERROR}>:-Werror>
                       $<$<BOOL:${UNDERSTORY_NATIVE}>:-march=native>)
if(UNDERSTORY_SANITIZE)
  # Instrumented code makes GCC 12 suspect empty optionals of being read.
  add_compile_options(-fsanitize=${UNDERSTORY_SANITIZE} -fno-sanitize-recover=all
                      -fno-omit-frame-pointer -Wno-maybe-uninitialized)
  add_link_options(-fsanitize=${UNDERSTORY_SANITIZE})
endif()
install(TARGETS understory_flags EXPORT understory)

# understory_library(NAME [INTERNAL] PUBLIC targets... PRIVATE targets...)
# Builds understory::NAME from every .cpp beside the calling CMakeLists.txt and in the folders below.
# INTERNAL: part of a program, not installed.
function(understory_library name)
  cmake_parse_arguments(ARG "INTERNAL" "" "PUBLIC;PRIVATE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  if(sources)
    add_library(understory_${name} STATIC ${sources})
    set(scope PUBLIC)
    target_link_libraries(understory_${name} PRIVATE ${ARG_PRIVATE} understory_flags)
    # Headers are read once for the files of a folder: less than half the work of a build from nothing.
    # Tests stay apart: their helpers have the same names.
    set_target_properties(understory_${name} PROPERTIES UNITY_BUILD ${UNDERSTORY_UNITY} UNITY_BUILD_BATCH_SIZE 24)
  else()
    add_library(understory_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(understory::${name} ALIAS understory_${name})
  set_target_properties(understory_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(understory_${name} ${scope}
    $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/understory>)
  # Programs that link an installed library compile its headers: the standard travels with it.
  target_compile_features(understory_${name} ${scope} cxx_std_20)
  target_link_libraries(understory_${name} ${scope} ${ARG_PUBLIC})
  if(ARG_INTERNAL)
    return()
  endif()
  install(TARGETS understory_${name} EXPORT understory ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  file(RELATIVE_PATH here "${CMAKE_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  install(DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/understory/${here}
          FILES_MATCHING PATTERN "*.hpp")
endfunction()

# understory_service(NAME PUBLIC targets...): the library of a service and, from its main.cpp,
# the executable understory-NAME.
function(understory_service name)
  cmake_parse_arguments(ARG "" "" "PUBLIC;PRIVATE" ${ARGN})
  understory_library(${name} ${ARGN})
  if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/main.cpp")
    string(REPLACE "_" "-" dashed ${name})
    add_executable(understory-${dashed} main.cpp)
    target_link_libraries(understory-${dashed} PRIVATE understory::${name} understory_flags)
    install(TARGETS understory-${dashed} COMPONENT runtime)
  endif()
endfunction()

# In a build from nothing the tests are most of the work: they share a precompiled header, and what they
# test is optimised, not they themselves. Together that is half of their compile time.
set(UNDERSTORY_TEST_OPTIONS $<$<CONFIG:Release>:-O1> $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)

# understory_test(NAME [RECORDED] targets...): one Catch2 executable from every .cpp in tests/NAME.
# RECORDED: its cases with the tag [recorded] read recordings. They are a CTest test of their own,
# NAME_recorded, which CTest reports as "Skipped" where recordings are missing (tests/skip.hpp).
function(understory_test name)
  cmake_parse_arguments(ARG "RECORDED" "" "" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/tests/${name}/*.cpp")
  if(NOT sources)
    return()
  endif()
  add_executable(test_${name} ${sources})
  target_link_libraries(test_${name} PRIVATE understory_test_main ${ARG_UNPARSED_ARGUMENTS} understory_flags)
  target_include_directories(test_${name} PRIVATE "${CMAKE_SOURCE_DIR}")
  if(UNDERSTORY_UNITY)
    target_precompile_headers(test_${name} REUSE_FROM understory_test_precompiled)
    target_compile_options(test_${name} PRIVATE ${UNDERSTORY_TEST_OPTIONS})
  endif()
  set_target_properties(test_${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  if(ARG_RECORDED)
    add_test(NAME ${name} COMMAND test_${name} "~[recorded]")
    add_test(NAME ${name}_recorded COMMAND test_${name} "[recorded]")
    # Printed only where nothing failed: no failure hides behind it.
    set_tests_properties(${name}_recorded PROPERTIES TIMEOUT 600 SKIP_RETURN_CODE 4
                         SKIP_REGULAR_EXPRESSION "cases skipped, none failed")
  else()
    add_test(NAME ${name} COMMAND test_${name})
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT 1200 SKIP_RETURN_CODE 4)
endfunction()
