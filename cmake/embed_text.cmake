# cmake -DINPUT=file -DOUTPUT=file.c -DNAME=symbol -P embed_text.cmake: a file as `const char NAME[]`, zero at its end.
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
file(WRITE ${OUTPUT} "extern const char ${NAME}[];\nconst char ${NAME}[] = {${bytes}0};\n")
