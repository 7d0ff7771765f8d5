# `find_package(understory)` for programs that use the libraries without the bus.
include(CMakePackageConfigHelpers)
set(config_dir "${CMAKE_INSTALL_LIBDIR}/cmake/understory")
install(EXPORT understory NAMESPACE understory:: DESTINATION ${config_dir})
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/understoryConfig.cmake.in"
  "${CMAKE_BINARY_DIR}/understoryConfig.cmake" INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file("${CMAKE_BINARY_DIR}/understoryConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/understoryConfig.cmake"
  "${CMAKE_BINARY_DIR}/understoryConfigVersion.cmake" DESTINATION ${config_dir})
