lumi_test(test_view_synthesis FOLDERS synthesize subsample run capture image lightfield base LABELS threads)
lumi_test(test_stand_mask FOLDERS synthesize subsample run capture image lightfield base)
