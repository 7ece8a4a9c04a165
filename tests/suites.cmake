# Joins the tests of several build folders into one ctest run with one summary:
#   cmake -DROOT=. -P tests/suites.cmake && cd build/tests && ctest
# A suite is the test folder of one build; names of tests carry the sanitizer, so that they stay apart.
set(suites
  release/tests                       # all
  fuzz/tests/unit                     # unit tests, address and undefined sanitizers, clang
  fuzz/tests/conformance              # the same, all backends of the drivers
  fuzz/tests/fuzz)                    # every fuzz target for TRIGMESH_FUZZ_SECONDS
include("${CMAKE_CURRENT_LIST_DIR}/thread_folders.cmake")
list(TRANSFORM thread_folders PREPEND "tsan/")
list(APPEND suites ${thread_folders})
set(content "# Written by tests/suites.cmake.\n")
foreach(suite IN LISTS suites)
  if(NOT EXISTS "${ROOT}/build/${suite}/CTestTestfile.cmake")
    message(FATAL_ERROR "build/${suite} is not configured; tools/run-tests does it")
  endif()
  string(APPEND content "subdirs(\"${ROOT}/build/${suite}\")\n")
endforeach()
file(WRITE "${ROOT}/build/tests/CTestTestfile.cmake" "${content}")
