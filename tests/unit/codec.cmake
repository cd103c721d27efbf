lumi_test(test_field FOLDERS lightfield)
lumi_test(test_codec_parts FOLDERS lightfield)
lumi_test(test_field_threads FOLDERS lightfield LABELS threads)
lumi_test(test_cluster FOLDERS compress)
