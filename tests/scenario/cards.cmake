add_executable(make_cards make_cards.c camera_script.c)
target_link_libraries(make_cards PRIVATE lumi_flags lumi_capture lumi_image lumi_base)
add_test(NAME cards_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/cards_test.sh $<TARGET_FILE:lumi> $<TARGET_FILE:make_cards>
  $<TARGET_FILE:make_dng>)
set_tests_properties(cards_test PROPERTIES LABELS slow TIMEOUT 900)
add_executable(make_films make_films.c camera_script.c)
target_link_libraries(make_films PRIVATE lumi_flags lumi_exchange lumi_capture lumi_image lumi_mechanism lumi_base)
add_test(NAME films_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/films_test.sh $<TARGET_FILE:lumi> $<TARGET_FILE:make_films>)
set_tests_properties(films_test PROPERTIES LABELS slow TIMEOUT 900)
