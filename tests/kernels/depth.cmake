lumi_test(test_depth_kernels FOLDERS depth lightfield base)
