add_executable(bench_judge bench_judge.c)
target_link_libraries(bench_judge PRIVATE lumi_flags lumi_judge lumi_sim)
