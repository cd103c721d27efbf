lumi_test(test_capture FOLDERS capture mechanism base)
lumi_test(test_rig FOLDERS mechanism base)
lumi_test(test_capture_crash FOLDERS capture mechanism base)
