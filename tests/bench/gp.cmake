add_executable(bench_gp bench_gp.c)
target_link_libraries(bench_gp PRIVATE lumi_flags lumi_evaluate lumi_image lumi_lightfield lumi_base)
