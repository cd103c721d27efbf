# lumid's manual pages against the program, and the Debian package.
if(LUMI_SANITIZE OR LUMI_FUZZ)
  return()
endif()
lumi_house(lumid_manual ${CMAKE_CURRENT_SOURCE_DIR}/lumid_manual.sh $<TARGET_FILE:lumid>
  ${PROJECT_SOURCE_DIR}/daemon/lumid/lumid.8 ${PROJECT_BINARY_DIR}/daemon/lumid/lumid.conf.5)
lumi_house(package ${CMAKE_CURRENT_SOURCE_DIR}/package.sh ${CMAKE_CPACK_COMMAND} ${PROJECT_BINARY_DIR})
