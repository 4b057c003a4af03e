/// Base64 (RFC 4648) of the bytes of arrays, for the page.
#pragma once

#include <bit>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace tendril::viewer {

[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

/// The numbers as they lie in memory, little-endian: what a typed array of JavaScript reads.
template <class Number>
[[nodiscard]] std::string base64(const std::vector<Number>& numbers) {
  static_assert(std::endian::native == std::endian::little, "the page expects little-endian numbers");
  return base64(std::as_bytes(std::span(numbers)));
}

}  // namespace tendril::viewer
