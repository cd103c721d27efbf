lumi_test(test_store FOLDERS store capture mechanism base LABELS threads)
