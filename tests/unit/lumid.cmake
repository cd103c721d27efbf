lumi_test(test_lumid_config FOLDERS lumid base)
