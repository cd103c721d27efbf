lumi_test(test_base FOLDERS base)
