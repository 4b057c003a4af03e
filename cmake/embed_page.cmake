# cmake -DPAGE=page.html -DOUT=page_template.cpp -P embed_page.cmake: the page as an array of bytes.
file(READ ${PAGE} BYTES HEX)
string(REGEX REPLACE "(................................)" "\\1\n" BYTES "${BYTES}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," BYTES "${BYTES}")
file(WRITE ${OUT} "// Made by cmake/embed_page.cmake from viewer/dist/page.html.
#include \"page_template.h\"

namespace tendril::viewer {
namespace {
constexpr unsigned char kPage[] = {
${BYTES}};
}  // namespace

std::string_view pageTemplate() { return {reinterpret_cast<const char*>(kPage), sizeof(kPage)}; }

}  // namespace tendril::viewer
")
