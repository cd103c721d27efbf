# find_package(lumi): lumi::lumi (shared) and lumi::lumi_static, which brings libvpx and threads along.
include(CMakeFindDependencyMacro)
find_dependency(Threads)
find_dependency(PkgConfig)
if(NOT TARGET PkgConfig::vpx)
  pkg_check_modules(vpx REQUIRED IMPORTED_TARGET GLOBAL vpx)
endif()
include(${CMAKE_CURRENT_LIST_DIR}/lumi-targets.cmake)
