if(TARGET PkgConfig::aravis)
  lumi_test(test_camera_aravis FOLDERS camera base)
endif()
lumi_test(test_gige_control FOLDERS sim_gige base)
