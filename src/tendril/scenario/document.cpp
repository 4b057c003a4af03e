#include "tendril/scenario/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

namespace tendril {
namespace {

bool isDigit(char c) { return c >= '0' && c <= '9'; }

/// A decimal number as YAML 1.2 and JSON write it: no hexadecimal, no underscores, no infinity. Correctly
/// rounded.
std::optional<double> parseNumber(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  std::string_view digits = text;
  if (!digits.empty() && digits.front() == '-') digits.remove_prefix(1);
  if (digits.empty() || !(isDigit(digits.front()) || digits.front() == '.')) return {};
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return {};
  return value;
}

bool isNonFinite(std::string_view text) {
  if (!text.empty() && (text.front() == '+' || text.front() == '-')) text.remove_prefix(1);
  if (!text.empty() && text.front() == '.') text.remove_prefix(1);
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower == "inf" || lower == "infinity" || lower == "nan";
}

std::optional<bool> parseBoolean(std::string_view text) {
  if (text == "true" || text == "True" || text == "TRUE") return true;
  if (text == "false" || text == "False" || text == "FALSE") return false;
  return {};
}

std::string inQuotes(std::string_view text) {
  std::string out = "\"";
  for (const char c : text.substr(0, 60)) out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  return out + (text.size() > 60 ? "...\"" : "\"");
}

}  // namespace

// ---------------------------------------------------------------- errors

void Value::fail(std::string_view what) const {
  throw InputError(fmt::format("{}: {}", placeInFile(*source_, line_), what));
}

void Value::refuse(std::string_view rule) const {
  fail(fmt::format("{} is {}; {}", path_.empty() ? "the file" : path_, describe(), rule));
}

std::string Value::describe() const {
  switch (kind_) {
    case Kind::nothing:
      return "empty";
    case Kind::list:
      return "a list";
    case Kind::map:
      return "a mapping";
    case Kind::text:
      return inQuotes(scalar_);
    case Kind::plain:
      return isWord() ? inQuotes(scalar_) : scalar_.substr(0, 60);
  }
  return {};
}

bool Value::isWord() const {
  if (kind_ == Kind::text) return true;
  return kind_ == Kind::plain && !parseNumber(scalar_) && !isNonFinite(scalar_) && !parseBoolean(scalar_);
}

// ---------------------------------------------------------------- mappings and lists

void Value::allowKeys(const std::vector<std::string>& keys) const {
  if (kind_ != Kind::map)
    refuse(fmt::format("it must be a mapping with the keys {}.", fmt::join(keys, ", ")));
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (std::find(keys.begin(), keys.end(), keys_[i]) != keys.end()) continue;
    const std::string near = nearestWord(keys_[i], keys);
    throw InputError(fmt::format("{}: unknown key {}{}; {}", placeInFile(*source_, items_[i].key_line_),
                                 inQuotes(keys_[i]), path_.empty() ? "" : fmt::format(" in {}", path_),
                                 near.empty() ? fmt::format("the keys are {}.", fmt::join(keys, ", "))
                                              : fmt::format("did you mean \"{}\"?", near)));
  }
}

const Value* Value::find(std::string_view key) const {
  for (std::size_t i = 0; i < keys_.size(); ++i)
    if (keys_[i] == key) return &items_[i];
  return nullptr;
}

const Value& Value::at(std::string_view key) const {
  if (const Value* value = find(key)) return *value;
  throw InputError(fmt::format("{}: {}{}{} is missing; add it.", placeInFile(*source_, key_line_), path_,
                               path_.empty() ? "" : ".", key));
}

const std::vector<Value>& Value::list(std::string_view rule) const {
  if (kind_ != Kind::list) refuse(rule);
  return items_;
}

// ---------------------------------------------------------------- scalars

double Value::number() const {
  if (kind_ == Kind::plain) {
    if (const auto value = parseNumber(scalar_); value && std::isfinite(*value)) return *value;
    if (isNonFinite(scalar_) || (!scalar_.empty() && parseNumber(scalar_.substr(0, 1))))
      refuse("it must be a finite decimal number.");
  }
  refuse("it must be a number.");
}

double Value::number(Predicate holds, std::string_view rule) const {
  const double value = number();
  if (!holds(value)) refuse(rule);
  return value;
}

double Value::number(double low, double high) const {
  const double value = number();
  if (!(value >= low && value <= high)) refuse(fmt::format("it must be between {:g} and {:g}.", low, high));
  return value;
}

std::int64_t Value::integer(std::int64_t low, std::int64_t high) const {
  const std::string rule = fmt::format("it must be a whole number between {} and {}.", low, high);
  if (kind_ != Kind::plain) refuse(rule);
  const char* begin = scalar_.data() + (scalar_.starts_with('+') ? 1 : 0);
  const char* end = scalar_.data() + scalar_.size();
  std::int64_t value = 0;
  const auto result = std::from_chars(begin, end, value);
  if (result.ec != std::errc{} || result.ptr != end || value < low || value > high) refuse(rule);
  return value;
}

bool Value::boolean() const {
  if (kind_ == Kind::plain)
    if (const auto value = parseBoolean(scalar_)) return *value;
  refuse("it must be true or false.");
}

std::string Value::text() const {
  if (!isWord()) refuse(kind_ == Kind::plain ? "it must be text; put it in quotes." : "it must be text.");
  for (const char c : scalar_)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) refuse("it must be one line of printable text.");
  return scalar_;
}

std::size_t Value::choice(const std::vector<std::string>& words) const {
  if (isWord()) {
    const auto word = std::find(words.begin(), words.end(), scalar_);
    if (word != words.end()) return static_cast<std::size_t>(word - words.begin());
    if (const std::string near = nearestWord(scalar_, words); !near.empty())
      refuse(fmt::format("did you mean \"{}\"?", near));
  }
  refuse(fmt::format("it must be one of {}.", fmt::join(words, ", ")));
}

// ---------------------------------------------------------------- small vectors

Eigen::VectorXd Value::vector(int size, std::string_view rule) const {
  if (kind_ != Kind::list) refuse(rule);
  if (items_.size() != static_cast<std::size_t>(size))
    fail(fmt::format("{} has {} values; {}", path_, items_.size(), rule));
  Eigen::VectorXd out(size);
  for (int i = 0; i < size; ++i) out[i] = items_[static_cast<std::size_t>(i)].number();
  return out;
}

Quaternion Value::unitQuaternion() const {
  const Eigen::VectorXd q = vector(4, "it must be a unit quaternion, [w, x, y, z].");
  long double squares = 0;
  for (const double x : q) squares += static_cast<long double>(x) * x;
  const long double length = std::sqrt(squares);
  if (!(std::abs(length - 1) <= 1e-3L))
    fail(fmt::format("{} has length {:.6g}; a unit quaternion [w, x, y, z] has length 1, to within 0.001.",
                     path_, static_cast<double>(length)));
  if (std::abs(length - 1) <= 1e-12L) return Quaternion(q[0], q[1], q[2], q[3]);
  const auto scaled = [&](int i) { return static_cast<double>(q[i] / length); };
  return Quaternion(scaled(0), scaled(1), scaled(2), scaled(3));
}

Pose Value::pose() const {
  allowKeys({"position_m", "orientation_wxyz"});
  Pose pose;
  pose.position = at("position_m").vector3();
  pose.rotation = at("orientation_wxyz").unitQuaternion();
  return pose;
}

}  // namespace tendril
