lumi_test(test_depth FOLDERS depth lightfield base LABELS threads TSAN_CASES "*thread*")
lumi_test(test_depth_stage FOLDERS depth run capture image lightfield base)
