lumi_test(test_core FOLDERS firmware_host)
lumi_test(test_core_sweeps FOLDERS firmware_host)
lumi_test(test_core_faults FOLDERS firmware_host)
lumi_test(test_states FOLDERS firmware_core)
