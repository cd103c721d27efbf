lumi_test(test_capture_copy FOLDERS capture mechanism base)
lumi_test(test_preview FOLDERS pipeline_preview capture image lightfield base LABELS threads TSAN_CASES "*thread*")
lumi_test(test_preview_field FOLDERS preview base)
