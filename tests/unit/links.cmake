lumi_test(test_clock_match FOLDERS daemon_rig)
