lumi_test(test_cpu_disks FOLDERS cpu viewset lightfield base LABELS threads)
