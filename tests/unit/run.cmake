lumi_test(test_run FOLDERS run LABELS threads)
lumi_test(test_places FOLDERS run)
