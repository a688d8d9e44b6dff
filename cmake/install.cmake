# cmake --install: headers and libraries of the C++ API, the programs, and the package that find_package(rrgate) reads.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set_target_properties(rr_node PROPERTIES EXPORT_NAME node)
set_target_properties(rr_platform PROPERTIES EXPORT_NAME platform)
set_target_properties(rr_tls PROPERTIES EXPORT_NAME tls)
set_target_properties(rr_transport PROPERTIES EXPORT_NAME transport)
set_target_properties(rr_discovery PROPERTIES EXPORT_NAME discovery)
set_target_properties(rr_http PROPERTIES EXPORT_NAME http)
set_target_properties(rr_subscribe PROPERTIES EXPORT_NAME subscribe)
install(
  TARGETS rr_options rr_boost rr_support rr_hardware rr_wire rr_robdef rr_types rr_member rr_session rr_discovery_core
          rr_platform rr_tls rrgate_asio rr_transport rr_http rr_node rr_discovery rr_subscribe rrgate
  EXPORT rrgateTargets
  RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}"
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(TARGETS rrgate-demo-create rrgate-demo-webcams RUNTIME DESTINATION "${CMAKE_INSTALL_LIBEXECDIR}/rrgate")

set(include_dir "${CMAKE_INSTALL_INCLUDEDIR}/rrgate")
install(DIRECTORY core node DESTINATION "${include_dir}" FILES_MATCHING PATTERN "*.hpp" PATTERN openssl.hpp EXCLUDE
        PATTERN generate EXCLUDE)

set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/rrgate")
install(EXPORT rrgateTargets NAMESPACE rrgate:: DESTINATION "${package_dir}")
configure_package_config_file(cmake/rrgateConfig.cmake.in "${PROJECT_BINARY_DIR}/rrgateConfig.cmake"
                              INSTALL_DESTINATION "${package_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/rrgateConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/rrgateConfig.cmake" "${PROJECT_BINARY_DIR}/rrgateConfigVersion.cmake"
              cmake/rrgate_generate.cmake
        DESTINATION "${package_dir}")

# The page, where it was built before, and what runs the gateway as a service.
install(DIRECTORY web/dist/ DESTINATION share/rrgate/web OPTIONAL)
install(FILES gateway-config/rrgate.service gateway-config/rrgate.socket DESTINATION share/rrgate/systemd)

# Who may open USB devices: udev reads rules below its prefix only, so for other prefixes the file is to be copied.
install(FILES gateway-config/60-robotraconteur-usb.rules DESTINATION lib/udev/rules.d)
