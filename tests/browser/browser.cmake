# The operator's page in Debian's Chromium, on the real lumid and a simulated rig (docs/page.md). Playwright and axe-core
# are fetched by npm into the build folder, once; nothing of them is shipped.
if(LUMI_SANITIZE OR LUMI_FUZZ OR NOT TARGET lumid)
  return()
endif()
set(packages ${CMAKE_CURRENT_BINARY_DIR}/packages)
add_test(NAME browser_packages COMMAND sh ${CMAKE_CURRENT_SOURCE_DIR}/packages.sh ${packages})
set_tests_properties(browser_packages PROPERTIES FIXTURES_SETUP browser_packages SKIP_RETURN_CODE 77 TIMEOUT 300
  LABELS "browser;slow")

# NAME.spec.mjs as the test browser_NAME; its pictures and figures are left in browser/NAME of the build folder. One at a
# time: browser, rig and lumid share two cores, and a rig whose frames come late is another test.
file(GLOB specs CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} *.spec.mjs)
foreach(spec ${specs})
  string(REPLACE ".spec.mjs" "" name ${spec})
  add_test(NAME browser_${name} COMMAND sh ${CMAKE_CURRENT_SOURCE_DIR}/run.sh $<TARGET_FILE:lumi>
    $<TARGET_FILE:lumid> ${packages} ${PROJECT_BINARY_DIR}/browser/${name} ${CMAKE_CURRENT_SOURCE_DIR}/${spec})
  set_tests_properties(browser_${name} PROPERTIES FIXTURES_REQUIRED browser_packages SKIP_RETURN_CODE 77 TIMEOUT 300
    RUN_SERIAL TRUE LABELS "browser;slow")
endforeach()
