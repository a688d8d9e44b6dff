# Debian packages, by CPack: rrgate (the program as a service) and rrgate-dev (the C++ API). ./dev package calls it, since the
# packages also hold files that it makes in RRGATE_PACKAGE_FILES: the man pages and the changelogs.
set(RRGATE_PACKAGE_FILES "${PROJECT_SOURCE_DIR}/build/package/files" CACHE PATH "What ./dev package makes for packages")

# Two components, "system" and "dev_system", that `cmake --install` leaves out: they have places outside of a prefix.
install_unit("/lib/systemd/system" system EXCLUDE_FROM_ALL)
install(FILES cmake/deb/gateway.json DESTINATION /etc/rrgate COMPONENT system EXCLUDE_FROM_ALL)
install(FILES cmake/deb/apparmor DESTINATION /etc/apparmor.d RENAME rrgate COMPONENT system EXCLUDE_FROM_ALL)
install(DIRECTORY "${RRGATE_PACKAGE_FILES}/man/" DESTINATION share/man/man1 COMPONENT system EXCLUDE_FROM_ALL)
foreach(completion bash-completion/completions/rrgate zsh/vendor-completions/_rrgate fish/vendor_completions.d/rrgate.fish)
  get_filename_component(folder "${completion}" DIRECTORY)
  install(FILES "${RRGATE_PACKAGE_FILES}/${completion}" DESTINATION share/${folder} COMPONENT system EXCLUDE_FROM_ALL)
endforeach()
foreach(package rrgate rrgate-dev)
  string(REPLACE "rrgate-dev" "dev_system" component "${package}")
  string(REPLACE "rrgate" "system" component "${component}")
  install(FILES cmake/deb/copyright "${RRGATE_PACKAGE_FILES}/${package}/changelog.gz"
          DESTINATION share/doc/${package} COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()
install(FILES "${RRGATE_PACKAGE_FILES}/CHANGELOG.md.gz" gateway-config/example.json DESTINATION share/doc/rrgate
        COMPONENT system EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME rrgate)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "gateway for Robot Raconteur")
set(CPACK_PACKAGE_VENDOR "the rrgate authors")
set(CPACK_PACKAGE_CONTACT "the rrgate authors <maintainers@rrgate.invalid>")
set(CPACK_PACKAGE_DIRECTORY "${PROJECT_SOURCE_DIR}/build/package")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
if(CMAKE_CROSSCOMPILING)
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
endif()
set(CPACK_COMPONENTS_ALL runtime system dev dev_system)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_GATEWAY_DESCRIPTION
"Serves Robot Raconteur devices to browsers and native clients through one port,
with users, TLS, a dashboard and an interface for HTTP clients.")
set(CPACK_DEBIAN_GATEWAY_PACKAGE_NAME rrgate)
set(CPACK_DEBIAN_GATEWAY_PACKAGE_SECTION net)
set(CPACK_DEBIAN_GATEWAY_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_GATEWAY_PACKAGE_DEPENDS "adduser, procps")  # the unit reloads by /bin/kill
set(CPACK_DEBIAN_GATEWAY_PACKAGE_RECOMMENDS ca-certificates)
set(CPACK_DEBIAN_GATEWAY_PACKAGE_CONTROL_EXTRA
    "${PROJECT_SOURCE_DIR}/cmake/deb/conffiles;${PROJECT_SOURCE_DIR}/cmake/deb/postinst;${PROJECT_SOURCE_DIR}/cmake/deb/prerm;${PROJECT_SOURCE_DIR}/cmake/deb/postrm")
set(CPACK_DEBIAN_API_DESCRIPTION
"The C++ API: headers and static libraries for devices and clients in C++20, and
for programs that have a gateway in them.")
set(CPACK_DEBIAN_API_PACKAGE_NAME rrgate-dev)
set(CPACK_DEBIAN_API_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_API_PACKAGE_DEPENDS
    "rrgate (= ${PROJECT_VERSION}), libboost1.81-dev | libboost-dev (>= 1.81), libssl-dev, libusb-1.0-0-dev, libspdlog-dev, libjpeg62-turbo-dev, nlohmann-json3-dev, zlib1g-dev")

include(CPack)
cpack_add_component_group(gateway)
cpack_add_component_group(api)
cpack_add_component(runtime GROUP gateway)
cpack_add_component(system GROUP gateway)
cpack_add_component(dev GROUP api)
cpack_add_component(dev_system GROUP api)
