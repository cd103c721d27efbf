add_library(lumi_fake_board STATIC fake_board.c)
target_link_libraries(lumi_fake_board PUBLIC lumi_wire lumi_flags PkgConfig::cmocka)
lumi_test(test_clock_match FOLDERS daemon_rig)
lumi_test(test_rig_link FOLDERS daemon_rig fake_board LABELS threads)
