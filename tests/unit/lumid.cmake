lumi_test(test_lumid_config FOLDERS lumid base)
lumi_test(test_lumid_tasks FOLDERS lumid base LABELS threads)

# libgpiod on a kernel that is the test's own; without umockdev this test is left out.
pkg_check_modules(UMOCKDEV IMPORTED_TARGET umockdev-1.0)
find_program(UMOCKDEV_WRAPPER umockdev-wrapper)
if(UMOCKDEV_FOUND AND UMOCKDEV_WRAPPER AND NOT LUMI_SANITIZE)
  add_executable(test_gpio test_gpio.c)
  target_compile_definitions(test_gpio PRIVATE _GNU_SOURCE)
  target_link_libraries(test_gpio PRIVATE lumi_gpio lumi_flags lumi_test_filter PkgConfig::UMOCKDEV PkgConfig::cmocka)
  add_test(NAME test_gpio COMMAND ${UMOCKDEV_WRAPPER} $<TARGET_FILE:test_gpio>)
  set_tests_properties(test_gpio PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 120)
endif()
