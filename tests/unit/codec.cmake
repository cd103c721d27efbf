lumi_test(test_field FOLDERS lightfield)
