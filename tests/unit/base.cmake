lumi_test(test_base FOLDERS base)
lumi_test(test_sort FOLDERS base)
