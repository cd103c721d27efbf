# The page's scripts that need no browser, by themselves.
find_program(LUMI_NODE NAMES node nodejs)
if(LUMI_NODE)
  add_test(NAME page_scripts COMMAND ${LUMI_NODE} ${CMAKE_CURRENT_SOURCE_DIR}/test_page_scripts.mjs)
  set_tests_properties(page_scripts PROPERTIES TIMEOUT 60)
endif()
