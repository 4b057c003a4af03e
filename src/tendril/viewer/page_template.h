/// The built page (viewer/dist/page.html), embedded by CMake.
#pragma once

#include <string_view>

namespace tendril::viewer {

/// The whole html, with one empty element for the data (kDataOpen kDataClose in page.cpp).
[[nodiscard]] std::string_view pageTemplate();

}  // namespace tendril::viewer
