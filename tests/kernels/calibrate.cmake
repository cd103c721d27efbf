lumi_test(test_descriptor_kernels FOLDERS calibrate run base)
