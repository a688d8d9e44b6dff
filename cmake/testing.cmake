# rr_add_test(NAME LIBRARIES target... SOURCES file...)
#
# One Catch2 program whose test cases become ctest tests, native and, through Node, as WebAssembly. Catch2's main is
# compiled once for all.
find_package(Python3 REQUIRED COMPONENTS Interpreter)

if(EMSCRIPTEN)
  # Header-only packages get an include directory of their own: /usr/include itself would shadow the sysroot.
  set(RR_TEST_INCLUDE "/usr/include" CACHE PATH "Directory that holds catch2/ and nlohmann/ (for the wasm build)")
  file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/test-include")
  foreach(package catch2 nlohmann)
    file(CREATE_LINK "${RR_TEST_INCLUDE}/${package}" "${PROJECT_BINARY_DIR}/test-include/${package}" SYMBOLIC)
  endforeach()
  add_library(rr_test_headers INTERFACE)
  target_include_directories(rr_test_headers SYSTEM INTERFACE "${PROJECT_BINARY_DIR}/test-include")
  # Emscripten 3.1.6 takes a Node that has fetch() for a browser and asks it for the file: hide fetch.
  set(CMAKE_CROSSCOMPILING_EMULATOR "${NODE_JS_EXECUTABLE};--no-experimental-fetch")
  # Catch2 reports by exceptions; the core below it stays built without them.
  target_compile_options(rr_test_headers INTERFACE -fexceptions)
  target_compile_definitions(rr_test_headers INTERFACE CATCH_CONFIG_NO_POSIX_SIGNALS)
  # -O1: at -O3 a test program is optimised for a minute after linking.
  target_link_options(rr_test_headers INTERFACE -fexceptions -sNODERAWFS=1 -sEXIT_RUNTIME=1 -sALLOW_MEMORY_GROWTH=1
                                                -sENVIRONMENT=node -O1)
else()
  find_package(Catch2 REQUIRED)
  find_package(nlohmann_json 3.11 REQUIRED)
  add_library(rr_test_headers INTERFACE)
  target_link_libraries(rr_test_headers INTERFACE Catch2::Catch2 nlohmann_json::nlohmann_json)
  if(Catch2_VERSION VERSION_GREATER_EQUAL 3)
    target_include_directories(rr_test_headers SYSTEM BEFORE INTERFACE "${PROJECT_SOURCE_DIR}/test/support/catch2_3")
  endif()
  # What is tested is compiled as it ships; the tests themselves run once, and are compiled in 3/5 of the time.
  target_compile_options(rr_test_headers INTERFACE $<$<CONFIG:Release>:-O0>)
endif()

add_library(rr_test_main STATIC "${PROJECT_SOURCE_DIR}/test/support/golden.cpp" "${PROJECT_SOURCE_DIR}/test/support/main.cpp")
target_link_libraries(rr_test_main PUBLIC rr::options rr::support rr_test_headers)
target_compile_definitions(rr_test_main PRIVATE "RR_GOLDEN_DIR=\"${PROJECT_SOURCE_DIR}/test/golden\"")

function(rr_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "LIBRARIES;SOURCES")
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE rr_test_main ${arg_LIBRARIES})
  # A cross-compiled program is started by its emulator, whose words are a list.
  get_target_property(emulator ${name} CROSSCOMPILING_EMULATOR)
  set(starter)
  if(emulator)
    set(starter ${emulator} $<TARGET_FILE:${name}>)
  endif()
  set(list "${CMAKE_CURRENT_BINARY_DIR}/${name}_tests.cmake")
  add_custom_command(
    TARGET ${name} POST_BUILD
    COMMAND Python3::Interpreter "${PROJECT_SOURCE_DIR}/cmake/discover_tests.py" "${list}" "${name}/"
            $<TARGET_FILE:${name}> ${starter}
    BYPRODUCTS "${list}"
    VERBATIM)
  # A program that is not built has one test, which says so.
  set(include_file "${CMAKE_CURRENT_BINARY_DIR}/${name}_include.cmake")
  file(WRITE "${include_file}" "if(EXISTS \"${list}\")\n  include(\"${list}\")\nelse()\n  add_test(${name}_not_built ${name}_not_built)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${include_file}")
endfunction()
