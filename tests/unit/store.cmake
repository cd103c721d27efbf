lumi_test(test_capture FOLDERS capture mechanism base)
