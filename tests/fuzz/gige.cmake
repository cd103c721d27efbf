lumi_fuzz(fuzz_gige FOLDERS sim_gige camera base)
if(TARGET PkgConfig::aravis)
  target_compile_definitions(fuzz_gige PRIVATE FUZZ_ARAVIS=1)
endif()
