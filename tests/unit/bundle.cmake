lumi_test(test_bundle FOLDERS calibrate mechanism LABELS slow)
lumi_test(test_bundle_parts FOLDERS calibrate mechanism)
lumi_test(test_calibration FOLDERS calibrate mechanism run LABELS slow)
lumi_test(test_pose_error FOLDERS evaluate calibrate run base)
