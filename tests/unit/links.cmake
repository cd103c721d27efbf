add_library(lumi_fake_board STATIC fake_board.c)
target_link_libraries(lumi_fake_board PUBLIC lumi_wire lumi_flags PkgConfig::cmocka)
add_library(lumi_fake_drive STATIC fake_drive.c)
target_link_libraries(lumi_fake_drive PUBLIC PkgConfig::libmodbus lumi_flags PkgConfig::cmocka)
lumi_test(test_clock_match FOLDERS daemon_rig)
lumi_test(test_rig_link FOLDERS daemon_rig fake_board LABELS threads)
lumi_test(test_rig_drive FOLDERS daemon_rig fake_board fake_drive)

# libusb on a kernel that is umockdev's; without it this test is left out.
pkg_check_modules(UMOCKDEV IMPORTED_TARGET umockdev-1.0)
find_program(UMOCKDEV_WRAPPER umockdev-wrapper)
if(UMOCKDEV_FOUND AND UMOCKDEV_WRAPPER AND NOT LUMI_SANITIZE)
  add_executable(test_rig_usb test_rig_usb.c)
  target_link_libraries(test_rig_usb PRIVATE lumi_daemon_rig lumi_wire lumi_flags lumi_test_filter PkgConfig::UMOCKDEV
    PkgConfig::cmocka)
  add_test(NAME test_rig_usb COMMAND ${UMOCKDEV_WRAPPER} $<TARGET_FILE:test_rig_usb>)
  set_tests_properties(test_rig_usb PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600)
endif()
