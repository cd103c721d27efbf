add_executable(bench_preview bench_preview.c)
target_link_libraries(bench_preview PRIVATE lumi_flags lumi_http lumi_preview lumi_camera lumi_store lumi_capture
  lumi_base m)
