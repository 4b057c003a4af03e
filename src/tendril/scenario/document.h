/// A document as a tree whose every value knows where it stands, so that each error can say so. Private to
/// this module.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tendril/base.h"

namespace tendril {

/// One value of a YAML or JSON document. The getters throw InputError: "file:line: key.path is value; what it
/// must be."
class Value {
 public:
  /// `plain` is an unquoted scalar (number, true/false or word), `text` a quoted one.
  enum class Kind { nothing, plain, text, list, map };

  /// The one document in `text`, YAML or JSON. Refuses what YAML lets pass and a reader should not: invalid
  /// UTF-8, several documents, a key given twice.
  [[nodiscard]] static Value fromText(const std::string& text, const std::string& source);
  /// JSON that was read elsewhere; lines are unknown. `where` is "file" or "file: key.path".
  [[nodiscard]] static Value fromJson(const nlohmann::json& json, const std::string& where);

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& scalar() const { return scalar_; }  // as written, without quotes

  /// Throws InputError with the place in front of `what`.
  [[noreturn]] void fail(std::string_view what) const;
  /// fail("<path> is <value>; <rule>"), the usual form.
  [[noreturn]] void refuse(std::string_view rule) const;

  // Mappings.
  /// Throws unless this is a mapping with no other keys than `keys`.
  void allowKeys(const std::vector<std::string>& keys) const;
  [[nodiscard]] const Value* find(std::string_view key) const;  // nullptr if absent
  /// Throws if absent.
  [[nodiscard]] const Value& at(std::string_view key) const;

  // Lists.
  [[nodiscard]] const std::vector<Value>& list(std::string_view rule) const;

  // Scalars. `rule` completes "<path> is <value>; " where the value is a number but `holds` is false.
  using Predicate = bool (*)(double);
  [[nodiscard]] double number() const;  // finite
  [[nodiscard]] double number(Predicate holds, std::string_view rule) const;
  [[nodiscard]] double number(double low, double high) const;
  [[nodiscard]] std::int64_t integer(std::int64_t low, std::int64_t high) const;
  [[nodiscard]] bool boolean() const;
  [[nodiscard]] std::string text() const;  // one line, printable
  /// The index of the word among `words`.
  [[nodiscard]] std::size_t choice(const std::vector<std::string>& words) const;

  // Small vectors.
  [[nodiscard]] Eigen::VectorXd vector(int size, std::string_view rule) const;
  [[nodiscard]] Vector3 vector3() const {
    return vector(3, "it must be a list of three numbers, [x, y, z].");
  }
  /// [w, x, y, z], normalised; more than 1e-3 off unit length is an error. A quaternion that is unit to 1e-12
  /// is kept bit for bit: what normalising makes is, so that writing a document and reading it again changes
  /// nothing.
  [[nodiscard]] Quaternion unitQuaternion() const;
  /// {position_m, orientation_wxyz}
  [[nodiscard]] Pose pose() const;

 private:
  friend class TreeBuilder;
  [[nodiscard]] std::string describe() const;  // the value as a person wrote it, short
  [[nodiscard]] bool isWord() const;           // a string, and not a number, true or false

  std::shared_ptr<const std::string> source_;  // the file as given
  std::string path_;                           // "rod.radius_m", "environment.meshes[0]"; "" for the root
  int line_ = 0;                               // 1-based; 0: unknown
  int key_line_ = 0;                           // where its key stands, for members of a mapping
  Kind kind_ = Kind::nothing;
  std::string scalar_;
  std::vector<std::string> keys_;  // of a mapping, as written
  std::vector<Value> items_;       // of a list or a mapping
};

/// "file:line", or "file" if the line is unknown (0).
[[nodiscard]] std::string placeInFile(const std::string& source, int line);

[[nodiscard]] inline bool isPositive(double x) { return x > 0; }
[[nodiscard]] inline bool isNotNegative(double x) { return x >= 0; }

}  // namespace tendril
