#include "document.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

namespace tendril {
namespace {

constexpr int kMaxDepth = 32;          // of nesting; a scenario needs 6
constexpr int kMaxValues = 2'000'000;  // aliases can make a short text into a huge tree

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

std::string place(const std::string& source, int line) {
  return line > 0 ? fmt::format("{}:{}", source, line) : source;
}

/// The length of the UTF-8 sequence at the front of `bytes`, 0 if there is none (overlong forms and
/// surrogates are none).
std::size_t utf8Length(std::string_view bytes) {
  const auto byte = [&](std::size_t i) {
    return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0u;
  };
  const auto follows = [&](std::size_t i, unsigned low = 0x80, unsigned high = 0xBF) {
    return byte(i) >= low && byte(i) <= high;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return follows(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const unsigned low = first == 0xE0 ? 0xA0 : 0x80, high = first == 0xED ? 0x9F : 0xBF;
    return follows(1, low, high) && follows(2) ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const unsigned low = first == 0xF0 ? 0x90 : 0x80, high = first == 0xF4 ? 0x8F : 0xBF;
    return follows(1, low, high) && follows(2) && follows(3) ? 4 : 0;
  }
  return 0;
}

/// Throws unless every byte is part of printable UTF-8 text.
void checkCharacters(std::string_view text, const std::string& source) {
  int line = 1;
  for (std::size_t i = 0, length = 0; i < text.size(); i += length) {
    length = utf8Length(text.substr(i));
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool control = (byte < 0x20 && byte != '\t' && byte != '\n' && byte != '\r') || byte == 0x7F;
    if (length == 0 || control)
      throw InputError(fmt::format("{}: holds the byte 0x{:02x}, which is not text; save the file as UTF-8.",
                                   place(source, line), byte));
    if (byte == '\n') ++line;
  }
}

std::string inQuotes(std::string_view text) {
  std::string out = "\"";
  for (const char c : text.substr(0, 60)) out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  return out + (text.size() > 60 ? "...\"" : "\"");
}

}  // namespace

// ---------------------------------------------------------------------------------------------- building the
// tree

/// Fills Values from yaml-cpp's nodes or from JSON.
class TreeBuilder {
 public:
  explicit TreeBuilder(const std::string& source) : source_(std::make_shared<const std::string>(source)) {}

  Value build(const YAML::Node& node, std::string path, int line_above, int depth = 0) {
    Value value = begin(std::move(path), depth);
    value.line_ = node.Mark().line >= 0 ? node.Mark().line + 1 : line_above;
    value.key_line_ = value.line_;
    if (node.IsScalar()) {
      const bool is_text = node.Tag() == "!" || node.Tag() == "tag:yaml.org,2002:str";
      value.kind_ = is_text ? Value::Kind::text : Value::Kind::plain;
      value.scalar_ = node.Scalar();
    } else if (node.IsSequence()) {
      value.kind_ = Value::Kind::list;
      for (const YAML::Node& item : node)
        value.items_.push_back(build(item, itemPath(value, value.items_.size()), value.line_, depth + 1));
    } else if (node.IsMap()) {
      value.kind_ = Value::Kind::map;
      for (const auto& member : node) {
        const YAML::Node &key = member.first, &item = member.second;
        const int key_line = key.Mark().line >= 0 ? key.Mark().line + 1 : value.line_;
        if (!key.IsScalar())
          throw InputError(fmt::format("{}: a key must be a word.", place(*source_, key_line)));
        addMember(value, key.Scalar(), build(item, memberPath(value, key.Scalar()), key_line, depth + 1),
                  key_line);
      }
    }
    return value;
  }

  Value build(const nlohmann::json& json, std::string path, int depth = 0) {
    Value value = begin(std::move(path), depth);
    if (json.is_array()) {
      value.kind_ = Value::Kind::list;
      for (const nlohmann::json& item : json)
        value.items_.push_back(build(item, itemPath(value, value.items_.size()), depth + 1));
    } else if (json.is_object()) {
      value.kind_ = Value::Kind::map;
      for (const auto& [key, item] : json.items())
        addMember(value, key, build(item, memberPath(value, key), depth + 1), 0);
    } else if (json.is_string()) {
      value.kind_ = Value::Kind::text;
      value.scalar_ = json.get<std::string>();
    } else if (!json.is_null()) {
      value.kind_ = Value::Kind::plain;
      value.scalar_ = json.dump();
    }
    return value;
  }

 private:
  Value begin(std::string path, int depth) {
    if (depth > kMaxDepth) throw InputError(fmt::format("{}: {} is nested too deeply.", *source_, path));
    if (++values_ > kMaxValues)
      throw InputError(fmt::format("{}: holds more than {} values.", *source_, kMaxValues));
    Value value;
    value.source_ = source_;
    value.path_ = std::move(path);
    return value;
  }
  static std::string itemPath(const Value& list, std::size_t i) {
    return fmt::format("{}[{}]", list.path_, i);
  }
  static std::string memberPath(const Value& map, const std::string& key) {
    return map.path_.empty() ? key : fmt::format("{}.{}", map.path_, key);
  }
  static void addMember(Value& map, const std::string& key, Value member, int key_line) {
    member.key_line_ = key_line;
    if (const Value* first = map.find(key))
      throw InputError(fmt::format("{}: {} appears twice (first in line {}); keep one.",
                                   place(*map.source_, key_line), member.path_, first->key_line_));
    map.keys_.push_back(key);
    map.items_.push_back(std::move(member));
  }

  std::shared_ptr<const std::string> source_;
  int values_ = 0;
};

Value Value::fromText(const std::string& text, const std::string& source) {
  checkCharacters(text, source);
  std::vector<YAML::Node> documents;
  try {
    documents = YAML::LoadAll(text);
  } catch (const YAML::Exception& e) {
    throw InputError(fmt::format("{}: this is not YAML: {}.", place(source, e.mark.line + 1), e.msg));
  }
  if (documents.empty() || documents.front().IsNull())
    throw InputError(fmt::format("{}: the file is empty.", source));
  if (documents.size() > 1)
    throw InputError(fmt::format("{}: a second document begins here; keep one.",
                                 place(source, documents[1].Mark().line + 1)));
  return TreeBuilder(source).build(documents.front(), "", 1);
}

Value Value::fromJson(const nlohmann::json& json, const std::string& where) {
  const std::size_t split = where.rfind(": ");
  const std::string path = split == std::string::npos ? "" : where.substr(split + 2);
  return TreeBuilder(where.substr(0, split)).build(json, path);
}

// ---------------------------------------------------------------------------------------------- errors

void Value::fail(std::string_view what) const {
  throw InputError(fmt::format("{}: {}", place(*source_, line_), what));
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

// ---------------------------------------------------------------------------------------------- mappings and
// lists

void Value::allowKeys(const std::vector<std::string>& keys) const {
  if (kind_ != Kind::map)
    refuse(fmt::format("it must be a mapping with the keys {}.", fmt::join(keys, ", ")));
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (std::find(keys.begin(), keys.end(), keys_[i]) != keys.end()) continue;
    const std::string near = nearestWord(keys_[i], keys);
    throw InputError(fmt::format("{}: unknown key {}{}; {}", place(*source_, items_[i].key_line_),
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
  throw InputError(fmt::format("{}: {}{}{} is missing; add it.", place(*source_, key_line_), path_,
                               path_.empty() ? "" : ".", key));
}

const std::vector<Value>& Value::list(std::string_view rule) const {
  if (kind_ != Kind::list) refuse(rule);
  return items_;
}

// ---------------------------------------------------------------------------------------------- scalars

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

// ---------------------------------------------------------------------------------------------- small
// vectors

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
