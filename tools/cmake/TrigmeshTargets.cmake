# The functions with which every folder declares its target.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# Warnings, sanitizers and debug checks that every target of ours is built with.
add_library(trigmesh_compile_options INTERFACE)
target_include_directories(trigmesh_compile_options INTERFACE "${CMAKE_SOURCE_DIR}" "${CMAKE_BINARY_DIR}/generated")
target_compile_options(trigmesh_compile_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Woverloaded-virtual
  -Wnon-virtual-dtor -Wcast-align -Wformat=2 -Wimplicit-fallthrough -Wdouble-promotion -Wundef -Wextra-semi
  -Wmissing-declarations
  $<$<CXX_COMPILER_ID:GNU>:-Wduplicated-cond -Wlogical-op>
  $<$<CXX_COMPILER_ID:Clang>:-Wthread-safety>
  $<$<BOOL:${TRIGMESH_WERROR}>:-Werror>
  # g++ 13 and 14 take the values inside of empty std::optionals for uninitialised; what is told by g++ 12 stays an error.
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,13>>:-Wno-error=maybe-uninitialized>
  # Multiplications are never fused behind our back: the same source gives the same bits on every x86 build.
  -ffp-contract=off)
target_compile_definitions(trigmesh_compile_options INTERFACE
  $<$<CONFIG:Debug>:EIGEN_INITIALIZE_MATRICES_BY_NAN _GLIBCXX_ASSERTIONS>)
if(TRIGMESH_SANITIZE)
  target_compile_options(trigmesh_compile_options INTERFACE -fsanitize=${TRIGMESH_SANITIZE} -fno-omit-frame-pointer
                                                            -fno-sanitize-recover=all)
  target_link_options(trigmesh_compile_options INTERFACE -fsanitize=${TRIGMESH_SANITIZE})
  # Half of the build would be checks for undefined behaviour inside Eigen's templates; memory is watched there too. What the checks
  # of null pointers, sizes of objects and types find, the address sanitizer finds as well. They, and all checks for undefined
  # behaviour in the tests themselves, would be a sixth of compiling.
  if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    target_compile_options(trigmesh_compile_options INTERFACE -fno-sanitize=null,object-size,vptr
      $<$<BOOL:$<TARGET_PROPERTY:TRIGMESH_IS_TEST>>:-fno-sanitize=undefined>)
    target_compile_options(trigmesh_compile_options INTERFACE
      "-fsanitize-ignorelist=${CMAKE_CURRENT_LIST_DIR}/sanitizer_ignorelist.txt")
  endif()
endif()

# Sanitizer builds compile several files of a target as one: half the time. Files with a name that a neighbour has too stay apart.
include(separate_sources)

# trigmesh_join_sources(TARGET SOURCES..)
function(trigmesh_join_sources target)
  if(NOT TRIGMESH_SANITIZE)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON)
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY "${CMAKE_SOURCE_DIR}" OUTPUT_VARIABLE folder)
  foreach(source IN LISTS ARGN)
    if("${folder}/${source}" IN_LIST separate_sources)
      set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
endfunction()

# What most files include is parsed once a build. With TRIGMESH_PRECOMPILE=OFF (tools/dev/check-trixie) a missing include is found.
if(TRIGMESH_PRECOMPILE)
  set(common_headers
    <Eigen/Core>
    <Eigen/Geometry>
    <Eigen/LU>
    <fmt/format.h>
    <opencv2/core.hpp>
    <tl/expected.hpp>
    <algorithm>
    <chrono>
    <filesystem>
    <functional>
    <map>
    <optional>
    <span>
    <string>
    <thread>
    <variant>
    <vector>)
  file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/generated/precompiled.cpp" CONTENT "// A target needs one source.\n")
  add_library(trigmesh_library_headers OBJECT "${CMAKE_BINARY_DIR}/generated/precompiled.cpp")
  add_library(trigmesh_program_headers OBJECT "${CMAKE_BINARY_DIR}/generated/precompiled.cpp")
  foreach(target trigmesh_library_headers trigmesh_program_headers)
    target_link_libraries(${target} PRIVATE Eigen3::Eigen fmt::fmt opencv_core tl::expected trigmesh_compile_options)
  endforeach()
  target_precompile_headers(trigmesh_library_headers PRIVATE ${common_headers})
  target_precompile_headers(trigmesh_program_headers PRIVATE ${common_headers} <CLI/CLI.hpp> <nlohmann/json.hpp>)
endif()

# trigmesh_precompile(TARGET library|program): with what such targets include parsed once
function(trigmesh_precompile target kind)
  if(TRIGMESH_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM trigmesh_${kind}_headers)
  endif()
endfunction()

# trigmesh_add_library(NAME sfm_camera SOURCES .. HEADERS .. PUBLIC .. PRIVATE ..)
# One folder, one target trigmesh_<NAME>. A folder of headers only becomes an INTERFACE library.
function(trigmesh_add_library)
  cmake_parse_arguments(ARG "" "NAME" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  set(target trigmesh_${ARG_NAME})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    trigmesh_join_sources(${target} ${ARG_SOURCES})
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS "${CMAKE_SOURCE_DIR}" FILES ${ARG_HEADERS})
    target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} trigmesh_compile_options)
    target_include_directories(${target} PUBLIC "${CMAKE_SOURCE_DIR}")
    trigmesh_precompile(${target} library)
  else()
    add_library(${target} INTERFACE)
    target_sources(${target} INTERFACE FILE_SET HEADERS BASE_DIRS "${CMAKE_SOURCE_DIR}" FILES ${ARG_HEADERS})
    target_link_libraries(${target} INTERFACE ${ARG_PUBLIC})
    target_include_directories(${target} INTERFACE "${CMAKE_SOURCE_DIR}")
  endif()
endfunction()

# Names of tests tell the sanitizer, so that several builds can be run as one (tests/suites.cmake).
set(test_prefix "")
set(test_environment "")
if(TRIGMESH_SANITIZE MATCHES "address")
  set(test_prefix "asan.")
elseif(TRIGMESH_SANITIZE MATCHES "thread")
  set(test_prefix "tsan.")
  # A program with threads would wait a second at its end for reports of others.
  set(test_environment ENVIRONMENT "TSAN_OPTIONS=atexit_sleep_ms=50")
endif()

# What tools/run-tests builds with sanitizers: parts of the tests only.
include("${CMAKE_SOURCE_DIR}/tests/thread_folders.cmake")
add_custom_target(trigmesh_unit_tests)
add_custom_target(trigmesh_thread_tests)
add_custom_target(trigmesh_fuzzers)

# trigmesh_add_test(NAME unit_sfm_camera SOURCES .. LIBRARIES .. LABEL unit [TIMEOUT 60])
# A GoogleTest program; every TEST in it becomes a ctest entry with the label and time-out. Suites whose name ends in Slow are left
# out under sanitizers.
function(trigmesh_add_test)
  cmake_parse_arguments(ARG "" "NAME;LABEL;TIMEOUT" "SOURCES;LIBRARIES" ${ARGN})
  if(NOT TRIGMESH_BUILD_TESTS)
    return()
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 60)
  endif()
  add_executable(${ARG_NAME} ${ARG_SOURCES})
  trigmesh_join_sources(${ARG_NAME} ${ARG_SOURCES})
  target_link_libraries(${ARG_NAME} PRIVATE ${ARG_LIBRARIES} trigmesh_tests_framework)
  set_target_properties(${ARG_NAME} PROPERTIES TRIGMESH_IS_TEST ON)
  target_precompile_headers(${ARG_NAME} REUSE_FROM trigmesh_tests_headers)
  if("${ARG_LABEL}" MATCHES "^(unit|conformance)$")
    add_dependencies(trigmesh_unit_tests ${ARG_NAME})
    foreach(folder IN LISTS thread_folders)
      set(folder "${CMAKE_SOURCE_DIR}/${folder}")
      cmake_path(IS_PREFIX folder "${CMAKE_CURRENT_SOURCE_DIR}" has_threads)
      if(has_threads)
        add_dependencies(trigmesh_thread_tests ${ARG_NAME})
      endif()
    endforeach()
  endif()
  set(filter "")
  if(TRIGMESH_SANITIZE)
    set(filter TEST_FILTER "-*Slow.*")
  endif()
  gtest_discover_tests(${ARG_NAME} DISCOVERY_MODE PRE_TEST TEST_PREFIX "${test_prefix}" ${filter}
                       PROPERTIES LABELS "${ARG_LABEL}" TIMEOUT ${ARG_TIMEOUT} ${test_environment})
endfunction()

# trigmesh_add_benchmark(NAME bench_matching SOURCES .. LIBRARIES ..)
function(trigmesh_add_benchmark)
  cmake_parse_arguments(ARG "" "NAME" "SOURCES;LIBRARIES" ${ARGN})
  if(NOT TRIGMESH_BUILD_BENCH)
    return()
  endif()
  add_executable(${ARG_NAME} ${ARG_SOURCES})
  target_link_libraries(${ARG_NAME} PRIVATE ${ARG_LIBRARIES} benchmark::benchmark_main trigmesh_compile_options)
endfunction()

# trigmesh_add_fuzzer(NAME fuzz_colmap_text SOURCES .. LIBRARIES .. CORPUS dir)
# A libFuzzer program; ctest runs it for TRIGMESH_FUZZ_SECONDS on its committed corpus (label fuzz).
set(TRIGMESH_FUZZ_SECONDS 15 CACHE STRING "Seconds that each fuzz target runs under ctest")
function(trigmesh_add_fuzzer)
  cmake_parse_arguments(ARG "" "NAME;CORPUS" "SOURCES;LIBRARIES" ${ARGN})
  if(NOT TRIGMESH_BUILD_FUZZ)
    return()
  endif()
  add_executable(${ARG_NAME} ${ARG_SOURCES})
  target_link_libraries(${ARG_NAME} PRIVATE ${ARG_LIBRARIES} trigmesh_compile_options)
  target_link_options(${ARG_NAME} PRIVATE -fsanitize=fuzzer)
  add_dependencies(trigmesh_fuzzers ${ARG_NAME})
  set(work "${CMAKE_CURRENT_BINARY_DIR}/${ARG_NAME}_corpus")
  file(MAKE_DIRECTORY "${work}")
  math(EXPR limit "${TRIGMESH_FUZZ_SECONDS} + 120")
  add_test(NAME ${ARG_NAME} COMMAND ${ARG_NAME} -max_total_time=${TRIGMESH_FUZZ_SECONDS} -timeout=10
                                    -rss_limit_mb=2048 -print_final_stats=1 "${work}" "${ARG_CORPUS}")
  set_tests_properties(${ARG_NAME} PROPERTIES LABELS fuzz TIMEOUT ${limit})
endfunction()
