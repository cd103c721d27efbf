lumi_test(test_depth FOLDERS depth lightfield base LABELS threads TSAN_CASES "*thread*")
