lumi_test(test_motion FOLDERS firmware_core mechanism)
lumi_test(test_motion_stop FOLDERS firmware_core mechanism)
lumi_test(test_homing FOLDERS firmware_core mechanism)
lumi_test(test_index_watch FOLDERS firmware_core mechanism)
