lumi_test(test_cast_kernels FOLDERS cpu viewset lightfield base)
