lumi_test(test_host_board FOLDERS firmware_host base)
