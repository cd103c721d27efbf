lumi_test(test_features FOLDERS calibrate run base)
lumi_test(test_pairs FOLDERS calibrate run base)
lumi_test(test_tracks FOLDERS calibrate run base)
lumi_test(test_rig_mask FOLDERS calibrate run base)
