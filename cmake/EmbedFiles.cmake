# Run as a script: cmake -DOUTPUT=x.cpp -DFOLDER=dir -DFILES="a;b" -P EmbedFiles.cmake
# Writes a source file that defines diorama::reportAsset with the content of the files.
set(text "// Made from the files of ${FOLDER} by cmake/EmbedFiles.cmake.\n#include \"eval/report_assets.h\"\n#include \"core/errors.h\"\n\nnamespace diorama {\nnamespace {\n")
set(cases "")
set(n 0)
foreach(name IN LISTS FILES)
  file(READ "${FOLDER}/${name}" content)
  string(APPEND text "const char kFile${n}[] = R\"DIORAMA~~(${content})DIORAMA~~\";\n")
  string(APPEND cases "  if (name == \"${name}\") return {kFile${n}, sizeof kFile${n} - 1};\n")
  math(EXPR n "${n} + 1")
endforeach()
string(APPEND text "}  // namespace\n\nstd::string_view reportAsset(std::string_view name) {\n${cases}  DIORAMA_CHECK(false && \"no such file in eval/report\");\n  return {};\n}\n\n}  // namespace diorama\n")
file(WRITE "${OUTPUT}" "${text}")
