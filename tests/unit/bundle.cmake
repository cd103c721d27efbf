lumi_test(test_bundle FOLDERS calibrate mechanism LABELS slow)
lumi_test(test_bundle_parts FOLDERS calibrate mechanism)
