lumi_test(test_bundle FOLDERS calibrate mechanism LABELS slow)
