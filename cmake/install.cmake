# cmake --install: headers and libraries of the C++ API, the programs, and the package that find_package(rrgate) reads.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set_target_properties(rrgate_core PROPERTIES EXPORT_NAME core)
set_target_properties(rrgate_node PROPERTIES EXPORT_NAME node)
set_target_properties(rrgate_gateway PROPERTIES EXPORT_NAME gateway)
install(
  TARGETS rrgate_core rr_options rr_boost rr_support rr_hardware rr_wire rr_robdef rr_types rr_member rr_session rr_discovery_core
          rrgate_node rr_passwords rr_platform rr_tls rrgate_asio rr_transport rr_http rr_node rr_discovery rr_subscribe rrgate
  EXPORT rrgateTargets
  RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT runtime
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT dev)
# Apart, since it needs libraries that devices and clients do not.
install(
  TARGETS rrgate_gateway rrgate_access rrgate_json rr_generate
  EXPORT rrgateGatewayTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT dev)
install(TARGETS rrgate-create-serial rrgate-demo-conference-room rrgate-demo-create rrgate-demo-fleet
                rrgate-demo-microassembly rrgate-demo-webcams
        RUNTIME DESTINATION "${CMAKE_INSTALL_LIBEXECDIR}/rrgate" COMPONENT runtime)
install(FILES examples/baxter/baxter.py RENAME rrgate-demo-baxter.py
        DESTINATION "${CMAKE_INSTALL_LIBEXECDIR}/rrgate" COMPONENT runtime)
install(FILES examples/create-minimal/serial_robot.py RENAME rrgate-demo-create-minimal.py
        DESTINATION "${CMAKE_INSTALL_LIBEXECDIR}/rrgate" COMPONENT runtime)
install(FILES examples/baxter/experimental.baxter.robdef
        DESTINATION "${CMAKE_INSTALL_LIBEXECDIR}/rrgate" COMPONENT runtime)

# Headers by task are the API. What they include lies in internal/, for templates and inline functions.
install(DIRECTORY include/rrgate DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT dev FILES_MATCHING PATTERN "*.hpp")
set(internal_dir "${CMAKE_INSTALL_INCLUDEDIR}/rrgate/internal")
install(DIRECTORY core node DESTINATION "${internal_dir}" COMPONENT dev FILES_MATCHING PATTERN "*.hpp" PATTERN openssl.hpp EXCLUDE
        PATTERN generate EXCLUDE)
install(FILES server/gateway/embedded_gateway.hpp DESTINATION "${internal_dir}/server/gateway" COMPONENT dev)

set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/rrgate")
install(EXPORT rrgateTargets NAMESPACE rrgate:: DESTINATION "${package_dir}" COMPONENT dev)
install(EXPORT rrgateGatewayTargets NAMESPACE rrgate:: DESTINATION "${package_dir}" COMPONENT dev)
configure_package_config_file(cmake/rrgateConfig.cmake.in "${PROJECT_BINARY_DIR}/rrgateConfig.cmake"
                              INSTALL_DESTINATION "${package_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/rrgateConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/rrgateConfig.cmake" "${PROJECT_BINARY_DIR}/rrgateConfigVersion.cmake"
              cmake/rrgate_generate.cmake
        DESTINATION "${package_dir}" COMPONENT dev)

# The page, the documentation and the notices of others' work, where they were built before, and the schema of configurations.
install(DIRECTORY web/dist/ DESTINATION share/rrgate/web COMPONENT runtime OPTIONAL)
install(DIRECTORY build/docs/ DESTINATION share/rrgate/docs COMPONENT runtime OPTIONAL)
install(FILES build/third-party.txt DESTINATION share/doc/rrgate COMPONENT runtime OPTIONAL)
install(FILES gateway-config/gateway.schema.json DESTINATION share/rrgate COMPONENT runtime)

# What runs the gateway as a service. The unit names the program of the prefix, which is known when it is installed.
function(install_unit folder component)
  set(unit "${PROJECT_BINARY_DIR}/${component}-unit/rrgate.service")
  install(CODE "
    get_filename_component(RRGATE_BINDIR \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}\" ABSOLUTE)
    configure_file(\"${PROJECT_SOURCE_DIR}/gateway-config/rrgate.service.in\" \"${unit}\" @ONLY)
    " COMPONENT ${component} ${ARGN})
  install(FILES "${unit}" gateway-config/rrgate.socket DESTINATION "${folder}" COMPONENT ${component} ${ARGN})
endfunction()
install_unit(share/rrgate/systemd unit)

# Who may open USB devices: udev reads rules below its prefix only, so for other prefixes the file is to be copied.
install(FILES gateway-config/60-robotraconteur-usb.rules DESTINATION lib/udev/rules.d COMPONENT runtime)

include(package)
