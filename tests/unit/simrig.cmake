lumi_test(test_host_board FOLDERS firmware_host base)
lumi_test(test_mechanics FOLDERS sim_rig mechanism base)
lumi_test(test_fault_script FOLDERS sim_rig mechanism base)
