if(TARGET lumi_sim_board)
  add_executable(bench_board bench_board.c)
  target_link_libraries(bench_board PRIVATE lumi_flags lumi_sim_board lumi_sim_rig)
endif()
