/// Builds the tree of Values from YAML text or from JSON.

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <map>
#include <sstream>

#include "tendril/scenario/document.h"

namespace tendril {
namespace {

constexpr std::size_t kMaxDepth = 32;        // of nesting; a scenario needs 6
constexpr std::size_t kMaxValues = 500'000;  // aliases can make a short text into a huge tree

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
                                   placeInFile(source, line), byte));
    if (byte == '\n') ++line;
  }
}

int lineOf(const YAML::Mark& mark) { return mark.line + 1; }  // 0, which stands for unknown, for a null mark

}  // namespace

std::string placeInFile(const std::string& source, int line) {
  return line > 0 ? fmt::format("{}:{}", source, line) : source;
}

/// Makes Values; their paths are filled in by finish() once the tree stands.
class TreeBuilder {
 public:
  static Value make(Value::Kind kind, std::string scalar, int line) {
    Value value;
    value.kind_ = kind;
    value.scalar_ = std::move(scalar);
    value.line_ = value.key_line_ = line;
    return value;
  }
  static void addItem(Value& list, Value item) { list.items_.push_back(std::move(item)); }
  static void addMember(Value& map, std::string key, int key_line, Value member) {
    member.key_line_ = key_line;
    if (member.kind_ == Value::Kind::nothing) member.line_ = key_line;
    map.keys_.push_back(std::move(key));
    map.items_.push_back(std::move(member));
  }
  static std::size_t size(const Value& value) {
    std::size_t values = 1;
    for (const Value& item : value.items_) values += size(item);
    return values;
  }

  /// Gives every value its path and source; throws on a key given twice and on deep nesting.
  static void finish(Value& value, const std::shared_ptr<const std::string>& source, std::string path,
                     std::size_t depth = 0) {
    value.source_ = source;
    value.path_ = std::move(path);
    if (depth > kMaxDepth)
      throw InputError(fmt::format("{}: this is nested too deeply.", placeInFile(*source, value.line_)));
    for (std::size_t i = 0; i < value.items_.size(); ++i) {
      Value& item = value.items_[i];
      if (value.kind_ == Value::Kind::list) {
        finish(item, source, fmt::format("{}[{}]", value.path_, i), depth + 1);
        continue;
      }
      const std::string& key = value.keys_[i];
      finish(item, source, value.path_.empty() ? key : fmt::format("{}.{}", value.path_, key), depth + 1);
      if (const Value* first = value.find(key); first != &item)
        throw InputError(fmt::format("{}: {} appears twice (first in line {}); keep one.",
                                     placeInFile(*source, item.key_line_), item.path_, first->key_line_));
    }
  }
};

namespace {

/// Receives one document from yaml-cpp's parser, event by event.
class YamlReceiver : public YAML::EventHandler {
 public:
  explicit YamlReceiver(const std::string& source) : source_(source) {}

  [[nodiscard]] Value& root() { return root_; }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (complete_)
      fail(mark, "the text goes on after its end; remove the bracket or document that is too many.");
  }
  void OnDocumentEnd() override { complete_ = true; }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    receive(TreeBuilder::make(Value::Kind::nothing, "", lineOf(mark)), mark, anchor);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& text) override {
    const bool is_text = tag == "!" || tag == "tag:yaml.org,2002:str";
    receive(TreeBuilder::make(is_text ? Value::Kind::text : Value::Kind::plain, text, lineOf(mark)), mark,
            anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto value = anchors_.find(anchor);
    if (value == anchors_.end()) fail(mark, "an alias stands inside the value it refers to.");
    values_ += TreeBuilder::size(value->second) - 1;
    receive(value->second, mark, YAML::NullAnchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    begin(Value::Kind::list, mark, anchor);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    begin(Value::Kind::map, mark, anchor);
  }
  void OnMapEnd() override { end(); }

 private:
  /// A list or a mapping that is being read.
  struct Open {
    Value value;
    YAML::Mark mark;
    YAML::anchor_t anchor;
    bool has_key = false;
    std::string key = {};
    int key_line = 0;
  };

  [[noreturn]] void fail(const YAML::Mark& mark, std::string_view what) const {
    throw InputError(fmt::format("{}: {}", placeInFile(source_, lineOf(mark)), what));
  }
  void begin(Value::Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (open_.size() > kMaxDepth) fail(mark, "this is nested too deeply.");
    open_.push_back({TreeBuilder::make(kind, "", lineOf(mark)), mark, anchor});
  }
  void end() {
    Open done = std::move(open_.back());
    open_.pop_back();
    receive(std::move(done.value), done.mark, done.anchor);
  }
  /// Puts a finished value where it belongs: it is the document, an item, a key or what belongs to a key.
  void receive(Value value, const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (++values_ > kMaxValues) fail(mark, fmt::format("the file holds more than {} values.", kMaxValues));
    if (anchor != YAML::NullAnchor) anchors_[anchor] = value;
    if (open_.empty()) {
      root_ = std::move(value);
      return;
    }
    Open& parent = open_.back();
    if (parent.value.kind() == Value::Kind::list) {
      TreeBuilder::addItem(parent.value, std::move(value));
    } else if (parent.has_key) {
      TreeBuilder::addMember(parent.value, std::move(parent.key), parent.key_line, std::move(value));
      parent.has_key = false;
    } else {
      if (value.kind() != Value::Kind::plain && value.kind() != Value::Kind::text)
        fail(mark, "a key must be a word.");
      parent.key = value.scalar();
      parent.key_line = lineOf(mark);
      parent.has_key = true;
    }
  }

  const std::string& source_;
  Value root_;
  bool complete_ = false;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Value> anchors_;
  std::size_t values_ = 0;
};

Value treeOf(const nlohmann::json& json) {
  if (json.is_null()) return TreeBuilder::make(Value::Kind::nothing, "", 0);
  if (json.is_string()) return TreeBuilder::make(Value::Kind::text, json.get<std::string>(), 0);
  if (json.is_primitive()) return TreeBuilder::make(Value::Kind::plain, json.dump(), 0);
  Value value = TreeBuilder::make(json.is_array() ? Value::Kind::list : Value::Kind::map, "", 0);
  for (const auto& [key, item] : json.items()) {
    if (json.is_array())
      TreeBuilder::addItem(value, treeOf(item));
    else
      TreeBuilder::addMember(value, key, 0, treeOf(item));
  }
  return value;
}

}  // namespace

Value Value::fromText(const std::string& text, const std::string& source) {
  checkCharacters(text, source);
  YamlReceiver receiver(source);
  try {
    std::istringstream in(text);
    YAML::Parser parser(in);
    if (parser.HandleNextDocument(receiver)) (void)parser.HandleNextDocument(receiver);
  } catch (const YAML::Exception& e) {
    throw InputError(fmt::format("{}: this is not YAML: {}.", placeInFile(source, lineOf(e.mark)), e.msg));
  }
  Value root = std::move(receiver.root());
  if (root.kind() == Kind::nothing) throw InputError(fmt::format("{}: the file is empty.", source));
  TreeBuilder::finish(root, std::make_shared<const std::string>(source), "");
  return root;
}

Value Value::fromJson(const nlohmann::json& json, const std::string& where) {
  const std::size_t split = where.rfind(": ");
  Value root = treeOf(json);
  TreeBuilder::finish(root, std::make_shared<const std::string>(where.substr(0, split)),
                      split == std::string::npos ? "" : where.substr(split + 2));
  return root;
}

}  // namespace tendril
