# Cameras over the real GigE Vision protocol, in a network namespace of their own; skipped where none can be had.
lumi_test(gige_cameras FOLDERS camera sim_gige sim base)
set_tests_properties(gige_cameras PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300)
