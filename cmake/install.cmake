# What `cmake --install` puts where:
#   bin/skylight                the program
#   lib/, include/skylight/     the tracker by itself: find_package(skylight), link skylight::tracker
#   lib/cmake/skylight/         for find_package
#   share/skylight/             what the program reads (service/resources.cpp finds it beside bin/) and the schemas
include(CMakePackageConfigHelpers)
set(SKYLIGHT_CONFIG_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/skylight)
set(SKYLIGHT_SHARE_DIR ${CMAKE_INSTALL_DATADIR}/skylight)

# The headers are C++20; the warnings and options of this tree stay at home.
target_compile_features(skylight_types INTERFACE cxx_std_20)
set_target_properties(skylight_types PROPERTIES EXPORT_NAME types)
set_target_properties(skylight_tracker PROPERTIES EXPORT_NAME tracker)

install(TARGETS skylight_types skylight_tracker EXPORT skylightTargets)
install(DIRECTORY tracker DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/skylight FILES_MATCHING PATTERN "*.hpp")
install(EXPORT skylightTargets NAMESPACE skylight:: DESTINATION ${SKYLIGHT_CONFIG_DIR})
configure_package_config_file(cmake/skylightConfig.cmake.in ${CMAKE_BINARY_DIR}/skylightConfig.cmake
                              INSTALL_DESTINATION ${SKYLIGHT_CONFIG_DIR})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${CMAKE_BINARY_DIR}/skylightConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/skylightConfig.cmake ${CMAKE_BINARY_DIR}/skylightConfigVersion.cmake
        DESTINATION ${SKYLIGHT_CONFIG_DIR})

install(TARGETS skylight)
install(DIRECTORY sim/scenarios DESTINATION ${SKYLIGHT_SHARE_DIR}/sim FILES_MATCHING PATTERN "*.json" PATTERN "*.png")
install(FILES sim/scenario.schema.json DESTINATION ${SKYLIGHT_SHARE_DIR}/sim)
install(FILES service/openapi.json DESTINATION ${SKYLIGHT_SHARE_DIR}/service)
install(DIRECTORY web DESTINATION ${SKYLIGHT_SHARE_DIR} PATTERN "README.md" EXCLUDE)
install(FILES deploy/skylight.sample.json deploy/skylight.schema.json DESTINATION ${SKYLIGHT_SHARE_DIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
