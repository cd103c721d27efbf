lumi_fuzz(fuzz_api FOLDERS http base)
lumi_fuzz(fuzz_lumid_answer FOLDERS base)
# The command line is one program, no folder: what is read there is built in.
target_sources(fuzz_lumid_answer PRIVATE ${PROJECT_SOURCE_DIR}/cli/lumid_answer.c ${PROJECT_SOURCE_DIR}/cli/capture_line.c)
target_link_libraries(fuzz_lumid_answer PRIVATE PkgConfig::glib_2_0 PkgConfig::json_glib_1_0)
