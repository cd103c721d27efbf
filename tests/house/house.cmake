# The walls of the house: what holds the tree together, checked. Sanitizer builds have no use for these.
if(LUMI_SANITIZE OR LUMI_FUZZ)
  return()
endif()

# lumi_house(NAME COMMAND...): a script of this folder as a CTest test; 77 means skipped.
function(lumi_house NAME)
  add_test(NAME house_${NAME} COMMAND sh ${ARGN})
  set_tests_properties(house_${NAME} PROPERTIES LABELS house SKIP_RETURN_CODE 77 TIMEOUT 600)
endfunction()
set(here ${CMAKE_CURRENT_SOURCE_DIR})

lumi_house(layers ${here}/layers.sh ${PROJECT_SOURCE_DIR} ${here}/layers.txt)
lumi_house(layers_seen ${here}/layers_test.sh ${here})
lumi_house(text ${here}/text.sh ${PROJECT_SOURCE_DIR} ${here}/bounds.txt)
lumi_house(format ${here}/format.sh ${PROJECT_SOURCE_DIR})
lumi_house(page ${here}/page.sh ${PROJECT_SOURCE_DIR}/daemon/page)

# Every header alone, with the include folders of the libraries that the program uses, and which Embree it is.
set(flags "$<TARGET_PROPERTY:lumi,INCLUDE_DIRECTORIES>;$<TARGET_PROPERTY:lumi_camera,INCLUDE_DIRECTORIES>")
set(defined "$<TARGET_PROPERTY:lumi_sim,COMPILE_DEFINITIONS>")
find_program(LUMI_CXX NAMES c++ g++ clang++)
if(LUMI_CXX)
  add_test(NAME house_headers COMMAND_EXPAND_LISTS COMMAND sh ${here}/headers.sh ${PROJECT_SOURCE_DIR}
    ${CMAKE_C_COMPILER} ${LUMI_CXX} ${PROJECT_BINARY_DIR}/generated/installed_headers.txt
    "-I$<JOIN:$<REMOVE_DUPLICATES:${flags}>,;-I>" "-D$<JOIN:$<REMOVE_DUPLICATES:${defined}>,;-D>")
  set_tests_properties(house_headers PROPERTIES LABELS house TIMEOUT 600)
endif()

# A small field, for the tests that want one: shot and processed by the program itself.
set(field ${CMAKE_CURRENT_BINARY_DIR}/field)
lumi_house(field ${here}/field.sh $<TARGET_FILE:lumi> ${field})
set_tests_properties(house_field PROPERTIES FIXTURES_SETUP house_field)

# The installed library, used from outside the tree by pkg-config and by CMake, shared and static.
lumi_house(install ${here}/install.sh ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR} ${CMAKE_C_COMPILER} ${CMAKE_COMMAND}
  ${field}/room.lumi)

# lumi info against what the file system says.
lumi_house(info ${here}/info.sh $<TARGET_FILE:lumi> ${field})
set_tests_properties(house_install house_info PROPERTIES FIXTURES_REQUIRED house_field)

# Manual and completion against `lumi help`.
set(manual_work ${CMAKE_CURRENT_BINARY_DIR}/manual)
file(MAKE_DIRECTORY ${manual_work})
add_test(NAME house_manual COMMAND bash ${here}/manual.sh $<TARGET_FILE:lumi> ${PROJECT_BINARY_DIR}/manual
  WORKING_DIRECTORY ${manual_work})
set_tests_properties(house_manual PROPERTIES LABELS house TIMEOUT 600)

option(LUMI_SANITIZER_TESTS "tests house_asan and house_tsan: build the tree with sanitizers and run its tests" OFF)
if(LUMI_SANITIZER_TESTS)
  # Memory and undefined behaviour: all but the long and slow tests. Threads: those that use them.
  lumi_house(asan ${here}/sanitize.sh ${PROJECT_SOURCE_DIR} asan -LE "long|slow")
  lumi_house(tsan ${here}/sanitize.sh ${PROJECT_SOURCE_DIR} tsan -L threads)
  # One at a time, and not beside other tests: each uses all cores.
  set_tests_properties(house_asan house_tsan PROPERTIES RUN_SERIAL TRUE TIMEOUT 2400)
endif()
