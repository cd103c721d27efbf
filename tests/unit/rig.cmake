lumi_test(test_sweep_plan FOLDERS mechanism base)
lumi_test(test_rig_control FOLDERS mechanism base)
lumi_test(test_profile_store FOLDERS firmware_core wire mechanism base)
lumi_test(test_plan_limits FOLDERS firmware_host)
