#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "axis.h"
#include "tendril/benchmark.h"

namespace tendril {
namespace {

using benchmark::timeLadder;
using benchmark::uniqueNames;

// Colours that the colour-blind tell apart (Okabe and Ito 2008), without those too pale on white.
constexpr std::array<const char*, 6> kColours = {"#0072b2", "#d55e00", "#009e73",
                                                 "#cc79a7", "#56b4e9", "#000000"};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char letter : text) {
    if (letter == '&')
      out += "&amp;";
    else if (letter == '<')
      out += "&lt;";
    else if (letter == '>')
      out += "&gt;";
    else
      out += letter;
  }
  return out;
}

/// A drawing in the making; coordinates in pixels, y down.
class Svg {
 public:
  Svg(double width, double height)
      : text_(fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
            "{1}\" font-family=\"sans-serif\" font-size=\"13\">\n"
            "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            width, height)) {}
  void line(double x1, double y1, double x2, double y2, const std::string& style) {
    text_ += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1, x2,
                         y2, style);
  }
  void rect(double x, double y, double width, double height, const std::string& style) {
    text_ += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" {}/>\n", x, y,
                         width, height, style);
  }
  void dot(double x, double y, const std::string& style) {
    text_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\" {}/>\n", x, y, style);
  }
  void path(const std::string& commands, const std::string& style) {
    text_ += fmt::format("<path d=\"{}\" fill=\"none\" {}/>\n", commands, style);
  }
  void label(double x, double y, const std::string& text, const std::string& style = "") {
    text_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" {}>{}</text>\n", x, y, style, escaped(text));
  }
  [[nodiscard]] std::string text() const { return text_ + "</svg>\n"; }

 private:
  std::string text_;
};

constexpr const char* kGrid = "stroke=\"#ddd\"";
constexpr const char* kFrame = "fill=\"none\" stroke=\"#888\"";
constexpr const char* kMiddle = "text-anchor=\"middle\"";
constexpr const char* kEnd = "text-anchor=\"end\"";
constexpr const char* kBold = "font-weight=\"bold\"";

/// Time on a logarithmic axis.
struct TimeAxis {
  std::vector<double> ticks;  // s, ascending
  double left, right;         // where the first and the last tick stand

  [[nodiscard]] double at(double t) const {
    const double low = std::log(ticks.front()), high = std::log(ticks.back());
    const double part = (std::log(std::max(t, ticks.front())) - low) / (high - low);
    return left + (right - left) * std::min(part, 1.0);
  }
  void draw(Svg& svg, double top, double bottom) const {
    double free = -1e9;  // no label before this
    for (const double tick : ticks) {
      svg.line(at(tick), top, at(tick), bottom, kGrid);
      const std::string text = fmt::format("{:g}", tick);
      const double half = 4.0 * static_cast<double>(text.size()) + 3;
      if (at(tick) - half < free) continue;
      free = at(tick) + half;
      svg.label(at(tick), bottom + 17, text, kMiddle);
    }
  }
};

/// The planners and the colour of each.
struct Legend {
  explicit Legend(std::span<const BenchmarkStatistics> statistics)
      : planners(uniqueNames(statistics, &BenchmarkStatistics::planner)) {}
  [[nodiscard]] std::string colour(const std::string& planner) const {
    const auto place = std::find(planners.begin(), planners.end(), planner) - planners.begin();
    return kColours.at(static_cast<std::size_t>(place) % kColours.size());
  }
  void draw(Svg& svg, double x, double y) const {
    for (const std::string& planner : planners) {
      svg.line(x, y - 4, x + 22, y - 4, fmt::format("stroke=\"{}\" stroke-width=\"3\"", colour(planner)));
      svg.label(x + 28, y, planner);
      x += 28 + 8.0 * static_cast<double>(planner.size()) + 24;
    }
  }
  std::vector<std::string> planners;
};

/// The share solved over time as a step line: right along the share that was, up to the share that is.
std::string steps(const BenchmarkStatistics& s, const TimeAxis& axis, double top, double bottom) {
  const auto height = [&](double share) { return bottom - share * (bottom - top); };
  std::string commands = fmt::format("M{:.1f} {:.1f}", axis.left, bottom);
  for (const double t : s.times) commands += fmt::format("H{:.1f}V{:.1f}", axis.at(t), height(s.solvedBy(t)));
  return commands + fmt::format("H{:.1f}", axis.right);
}

}  // namespace

std::string successPlot(std::span<const BenchmarkStatistics> statistics) {
  const Legend legend(statistics);
  const std::vector<std::string> scenarios = uniqueNames(statistics, &BenchmarkStatistics::scenario);
  const std::vector<double> ticks = timeLadder(statistics);
  const int columns = scenarios.size() > 1 ? 2 : 1;
  const int rows = (static_cast<int>(scenarios.size()) + columns - 1) / columns;
  const double panel_width = 480, panel_height = 270, head = 40;
  Svg svg(columns * panel_width, head + rows * panel_height);
  legend.draw(svg, 60, 24);
  for (std::size_t i = 0; i < scenarios.size(); ++i) {
    const double x = panel_width * static_cast<double>(i % static_cast<std::size_t>(columns));
    const double y = head + panel_height * static_cast<double>(i / static_cast<std::size_t>(columns));
    const TimeAxis axis{ticks, x + 60, x + panel_width - 20};
    const double top = y + 25, bottom = y + panel_height - 45;
    svg.label((axis.left + axis.right) / 2, y + 16, scenarios[i], fmt::format("{} {}", kMiddle, kBold));
    axis.draw(svg, top, bottom);
    for (int percent = 0; percent <= 100; percent += 25) {
      const double level = bottom - percent * (bottom - top) / 100;
      svg.line(axis.left, level, axis.right, level, kGrid);
      svg.label(axis.left - 6, level + 4, fmt::format("{} %", percent), kEnd);
    }
    svg.rect(axis.left, top, axis.right - axis.left, bottom - top, kFrame);
    svg.label((axis.left + axis.right) / 2, bottom + 35, "wall time [s]", kMiddle);
    for (const BenchmarkStatistics& s : statistics)
      if (s.scenario == scenarios[i])
        svg.path(steps(s, axis, top, bottom),
                 fmt::format("stroke=\"{}\" stroke-width=\"2\"", legend.colour(s.planner)));
  }
  return svg.text();
}

std::string timesPlot(std::span<const BenchmarkStatistics> statistics) {
  const Legend legend(statistics);
  std::size_t longest = 0;
  for (const BenchmarkStatistics& s : statistics)
    longest = std::max(longest, s.scenario.size() + s.planner.size() + 2);
  const double left = 20 + 7.5 * static_cast<double>(longest), row = 36, top = 20;
  const double bottom = top + row * static_cast<double>(statistics.size());
  const TimeAxis axis{timeLadder(statistics), left, left + 560};
  Svg svg(axis.right + 110, bottom + 50);
  axis.draw(svg, top, bottom);
  svg.rect(axis.left, top, axis.right - axis.left, bottom - top, kFrame);
  svg.label((axis.left + axis.right) / 2, bottom + 38, "wall time [s]", kMiddle);
  double y = top + row / 2;
  for (const BenchmarkStatistics& s : statistics) {
    const std::string colour = legend.colour(s.planner);
    svg.label(left - 10, y + 4, s.scenario + ", " + s.planner, kEnd);
    for (std::size_t i = 0; i < s.times.size(); ++i)  // three lanes, so that near ones do not hide each other
      svg.dot(axis.at(s.times[i]), y - 7 + 7.0 * static_cast<double>(i % 3),
              fmt::format("fill=\"{}\" fill-opacity=\"0.45\"", colour));
    if (!s.times.empty()) {
      const double low = axis.at(quantile(s.times, 0.25)), high = axis.at(quantile(s.times, 0.75));
      const double median = axis.at(s.wall_time.median);
      svg.rect(low, y - 13, high - low, 26,
               fmt::format("fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"", colour));
      svg.line(median, y - 13, median, y + 13, fmt::format("stroke=\"{}\" stroke-width=\"3\"", colour));
    }
    svg.label(axis.right + 10, y + 4, fmt::format("{} of {}", s.successes, s.runs));
    y += row;
  }
  return svg.text();
}

}  // namespace tendril
