#include <fmt/format.h>

#include <charconv>
#include <tuple>

#include "tendril/benchmark.h"

namespace tendril {
namespace {

/// Calls visit(column, field) for every column of runs.csv, so that reader and writer agree.
template <class Run, class Visit>
void visitColumns(Run& run, Visit&& visit) {
  visit("scenario", run.scenario);
  visit("planner", run.planner);
  visit("seed", run.seed);
  visit("threads", run.threads);
  visit("status", run.status);
  visit("wall_time_s", run.wall_time);
  visit("cpu_time_s", run.cpu_time);
  visit("iterations", run.iterations);
  visit("states", run.states);
  visit("steps", run.steps);
  visit("simulated_time_s", run.simulated_time);
  visit("verified", run.verified);
}

std::string header() {
  std::vector<std::string> columns;
  const BenchmarkRun run;
  visitColumns(run, [&](const char* column, const auto&) { columns.emplace_back(column); });
  return fmt::format("{}", fmt::join(columns, ","));
}

/// A field as RFC 4180 writes it.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char letter : text) out += letter == '"' ? "\"\"" : std::string(1, letter);
  return out + '"';
}

template <class Number>
std::string quoted(const Number& number) {
  return fmt::format("{}", number);
}

/// The records of a CSV text, each with the line it begins on.
struct Record {
  std::size_t line = 1;
  std::vector<std::string> fields;
};
std::vector<Record> records(const std::string& text) {
  std::vector<Record> found;
  std::string field;
  Record record;
  bool inside = false;
  std::size_t line = 1;
  const auto endField = [&] { record.fields.push_back(field), field.clear(); };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char letter = text[i];
    if (letter == '\n') ++line;
    if (inside) {
      if (letter != '"')
        field += letter;
      else if (i + 1 < text.size() && text[i + 1] == '"')
        field += text[++i];
      else
        inside = false;
    } else if (letter == '"') {
      inside = true;
    } else if (letter == ',') {
      endField();
    } else if (letter == '\n') {
      endField();
      found.push_back(std::move(record));
      record = {line, {}};
    } else if (letter != '\r') {
      field += letter;
    }
  }
  if (inside || !field.empty() || !record.fields.empty()) {  // the last line has no end
    endField();
    found.push_back(std::move(record));
  }
  return found;
}

/// Reads `text` into `field`; false if it is not a value of that type.
bool readField(const std::string& text, std::string& field) {
  field = text;
  return !text.empty();
}
bool readField(const std::string& text, bool& field) {
  field = text == "true";
  return field || text == "false";
}
template <class Number>
bool readField(const std::string& text, Number& field) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), field);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::string toCsv(std::span<const BenchmarkRun> runs) {
  std::string text = header() + '\n';
  for (const BenchmarkRun& run : runs) {
    std::vector<std::string> fields;
    visitColumns(run, [&](const char*, const auto& field) { fields.push_back(quoted(field)); });
    text += fmt::format("{}\n", fmt::join(fields, ","));
  }
  return text;
}

std::vector<BenchmarkRun> readRuns(const std::filesystem::path& file) {
  const std::vector<Record> lines = records(readFile(file));
  const auto fail = [&](std::size_t line, const std::string& what) {
    throw InputError(fmt::format("{}:{}: {}; repair or remove the file.", file.string(), line, what));
  };
  std::vector<BenchmarkRun> runs;
  for (const Record& record : lines) {
    if (record.line == 1) {
      if (fmt::format("{}", fmt::join(record.fields, ",")) != header())
        fail(1, "the columns are not " + header());
      continue;
    }
    BenchmarkRun run;
    std::size_t i = 0;
    visitColumns(run, [&](const char* column, auto& field) {
      if (i >= record.fields.size() || !readField(record.fields[i], field))
        fail(record.line, fmt::format("{} is missing or wrong", column));
      ++i;
    });
    if (i != record.fields.size()) fail(record.line, "there are too many columns");
    runs.push_back(std::move(run));
  }
  return runs;
}

}  // namespace tendril
