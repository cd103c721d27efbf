lumi_test(test_sweep_plan FOLDERS mechanism base)
