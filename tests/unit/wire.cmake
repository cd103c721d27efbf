lumi_test(test_wire_frame FOLDERS wire)
lumi_test(test_wire_session FOLDERS wire)
lumi_test(test_wire_torture FOLDERS wire)
