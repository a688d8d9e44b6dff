# rr::options carries the language level, warnings and sanitizers; every target of ours links it.
add_library(rr_options INTERFACE)
add_library(rr::options ALIAS rr_options)
target_compile_features(rr_options INTERFACE cxx_std_20)
target_include_directories(rr_options INTERFACE "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>"
                                                "$<INSTALL_INTERFACE:include/rrgate/internal>")
# Warnings are ours; who uses the package, installed or in a folder, has their own.
if(PROJECT_IS_TOP_LEVEL)
  target_compile_options(rr_options INTERFACE
    "$<BUILD_INTERFACE:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wconversion;-Wno-sign-conversion;-Wno-missing-field-initializers>")
endif()

# Where functions of other libraries are is looked up at the start, and cannot be written over afterwards. Compilers of Debian
# make programs that lie anywhere in memory by themselves; test/server/process_test.py checks what came of both.
if(NOT EMSCRIPTEN)
  target_link_options(rr_options INTERFACE "$<BUILD_INTERFACE:-Wl,-z,relro,-z,now,-z,noexecstack>")
endif()

# GCC would begin to collect garbage at 128 MB and then again and again: an eighth of its time. One run takes 1.6 GB at most.
if(PROJECT_IS_TOP_LEVEL)
  target_compile_options(rr_options INTERFACE
    "$<$<CXX_COMPILER_ID:GNU>:$<BUILD_INTERFACE:SHELL:--param ggc-min-heapsize=1500000>>")
endif()

set(RR_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize= (address,undefined or thread)")
if(RR_SANITIZE)
  target_compile_options(rr_options INTERFACE -fsanitize=${RR_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  # That check opens a pipe to look at memory, and takes it for bad in the tests that run out of descriptors.
  target_compile_options(rr_options INTERFACE -fno-sanitize=vptr)
  target_link_options(rr_options INTERFACE -fsanitize=${RR_SANITIZE})
endif()
option(RR_FUZZ "Build the libFuzzer targets (clang only)" OFF)
if(RR_FUZZ)
  # clang 14 cannot assemble coroutines with the check of function types: "difference across sections".
  target_compile_options(rr_options INTERFACE -fsanitize=fuzzer-no-link -fno-sanitize=function)
endif()

# Several files in one compiler run: most of a file's time goes into the headers that it shares with its neighbours.
# So names in anonymous namespaces are unique within a folder.
option(RR_UNITY_BUILD "Compile several files of a library together" ON)
set(CMAKE_UNITY_BUILD ${RR_UNITY_BUILD})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 6)
if(RR_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC takes a file that is included for a header, whose types others could see.
  if(PROJECT_IS_TOP_LEVEL)
    target_compile_options(rr_options INTERFACE "$<BUILD_INTERFACE:-Wno-subobject-linkage>")
  else()
    add_compile_options(-Wno-subobject-linkage)  # of this folder's targets alone
  endif()
endif()

if(EMSCRIPTEN)
  # Boost gets an include directory of its own: /usr/include itself would shadow the sysroot.
  set(RR_BOOST_ROOT "/usr/include" CACHE PATH "Directory that holds boost/ (for the wasm build)")
  file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/boost-include")
  file(CREATE_LINK "${RR_BOOST_ROOT}/boost" "${PROJECT_BINARY_DIR}/boost-include/boost" SYMBOLIC)
  add_library(rr_boost INTERFACE)
  target_include_directories(rr_boost SYSTEM INTERFACE "${PROJECT_BINARY_DIR}/boost-include")
else()
  find_package(Boost 1.81 REQUIRED)
  add_library(rr_boost INTERFACE)
  target_link_libraries(rr_boost INTERFACE Boost::headers)
endif()
add_library(rr::boost ALIAS rr_boost)
