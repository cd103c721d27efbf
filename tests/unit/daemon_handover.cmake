lumi_test(test_handover FOLDERS handover capture base LABELS threads)
