add_library(lumi_engine_bench STATIC engine_bench.c)
target_link_libraries(lumi_engine_bench PRIVATE lumi_flags PUBLIC lumi_engine)
lumi_test(test_engine FOLDERS engine_bench engine store capture mechanism base)
lumi_test(test_match FOLDERS engine base)
