lumi_test(test_motion FOLDERS firmware_core)
