lumi_test(test_mesh FOLDERS lightfield base)
