lumi_test(test_handover FOLDERS handover capture base LABELS threads)
lumi_test(test_store_crash FOLDERS handover store capture mechanism base LABELS slow)
