# What users of the libraries link, installed or by add_subdirectory; all other targets are internal.
#
#   rrgate::core      the protocol without input and output
#   rrgate::node      devices and clients: rrgate/device.hpp, rrgate/client.hpp, rrgate/subscribe.hpp
#   rrgate::gateway   a gateway inside a program: rrgate/gateway.hpp
#   rrgate::rrgate    the program; rrgate_generate() runs it

add_library(rrgate_core INTERFACE)
add_library(rrgate::core ALIAS rrgate_core)
target_link_libraries(rrgate_core INTERFACE rr::session rr::discovery_core rr::hardware)

add_library(rrgate_node INTERFACE)
add_library(rrgate::node ALIAS rrgate_node)
target_link_libraries(rrgate_node INTERFACE rrgate_core rr::node rr::discovery rr::subscribe)

foreach(target rrgate_node rrgate_gateway)
  target_include_directories(${target} INTERFACE "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>"
                                                 "$<INSTALL_INTERFACE:include>")
endforeach()
