lumi_test(test_disks FOLDERS geometry)
