lumi_test(test_disk_renderer FOLDERS cpu viewset lightfield base LABELS threads)
lumi_test(test_metrics FOLDERS evaluate lightfield base LABELS threads)
lumi_test(test_viewset FOLDERS cpu viewset lightfield base LABELS threads)
lumi_test(test_shots FOLDERS evaluate exchange lightfield base)
