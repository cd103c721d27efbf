lumi_test(test_disk_renderer FOLDERS cpu viewset lightfield base LABELS threads)
