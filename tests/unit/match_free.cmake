lumi_test(test_match_free FOLDERS engine)
