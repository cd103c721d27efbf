lumi_fuzz(fuzz_field FOLDERS lightfield)
lumi_fuzz(fuzz_tile FOLDERS lightfield)

# The corpora of both are made by this program: fuzz_codec_corpus FOLDER writes FOLDER/fuzz_field, FOLDER/fuzz_tile.
if(NOT LUMI_FUZZ)
  add_executable(fuzz_codec_corpus fuzz_codec_corpus.c)
  target_include_directories(fuzz_codec_corpus PRIVATE ${PROJECT_SOURCE_DIR}/tests/unit)
  target_link_libraries(fuzz_codec_corpus PRIVATE lumi_lightfield)
endif()
