# rrgate_generate(TARGET [COMPAT] [IMPORTS folder...] FILES definition.robdef...)
#
# Adds the C++ classes of service definitions to a target: `#include "com__example__robot.hpp"` for com.example.robot.
# Definitions that these import are looked for among them, beside them, and in the IMPORTS folders; what is found there
# must be generated for a library that the target links. COMPAT reads old definitions, as `rrgate generate --compat` does.
function(rrgate_generate target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "COMPAT" "" "FILES;IMPORTS")
  if(NOT arg_FILES)
    set(arg_FILES ${arg_UNPARSED_ARGUMENTS})
  endif()
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/${target}_definitions")
  file(MAKE_DIRECTORY "${folder}")
  set(files)
  set(outputs)
  set(search)
  if(arg_COMPAT)
    list(APPEND search --compat)
  endif()
  foreach(import IN LISTS arg_IMPORTS)
    cmake_path(ABSOLUTE_PATH import)
    list(APPEND search -I "${import}")
  endforeach()
  foreach(file IN LISTS arg_FILES)
    cmake_path(ABSOLUTE_PATH file)
    file(STRINGS "${file}" service REGEX "^[ \t]*service[ \t]" LIMIT_COUNT 1)
    if(NOT service MATCHES "service[ \t]+([A-Za-z0-9_.]+)")
      message(FATAL_ERROR "rrgate_generate: ${file} has no service statement")
    endif()
    string(REPLACE "." "__" name "${CMAKE_MATCH_1}")
    list(APPEND files "${file}")
    list(APPEND outputs "${folder}/${name}.hpp" "${folder}/${name}.cpp")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
  endforeach()
  add_custom_command(
    OUTPUT ${outputs}
    COMMAND rrgate::rrgate generate cpp ${files} ${search} -o "${folder}"
    DEPENDS ${files} rrgate::rrgate
    COMMENT "Generating C++ classes of service definitions for ${target}"
    VERBATIM)
  target_sources(${target} PRIVATE ${outputs})
  target_include_directories(${target} PUBLIC "$<BUILD_INTERFACE:${folder}>")
  target_link_libraries(${target} PUBLIC rrgate::node)
endfunction()
