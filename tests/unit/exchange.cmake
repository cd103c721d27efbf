lumi_test(test_exchange FOLDERS exchange capture image base)
lumi_test(test_import FOLDERS exchange capture image base)
lumi_test(test_view_export FOLDERS exchange lightfield image base)
lumi_test(test_shot_match FOLDERS exchange image base)
