lumi_test(test_run FOLDERS run LABELS threads)
