lumi_test(test_run FOLDERS run LABELS threads)
lumi_test(test_places FOLDERS run)
lumi_test(test_recent FOLDERS run)
