lumi_test(test_prefilter FOLDERS prefilter cpu viewset lightfield base LABELS threads)
