add_library(lumi_engine_double STATIC engine_double.c)
target_link_libraries(lumi_engine_double PUBLIC lumi_http)
lumi_test(test_api_server FOLDERS engine_double http LABELS threads)
lumi_test(test_doctor FOLDERS doctor)
