/// The page as a reader of the file sees it: the data element is cut out of the html and decoded here, by
/// other means.
#include "tendril/viewer.h"

#include <gtest/gtest.h>

#include <cstring>

namespace tendril {
namespace {

using nlohmann::json;

constexpr double kRadius = 0.01;
constexpr double kContactDistance = 0.002;
const std::string kOpen = R"(<script type="application/json" id="tendril-data">)";

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tendril-page-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// A straight rod along x from `start`, turned by `twist` [rad] about its axis from end to end.
RodShape straightRod(const Vector3& start, double length, int elements, double twist = 0) {
  RodShape shape;
  for (int i = 0; i <= elements; ++i) {
    const double t = double(i) / elements;
    shape.push_back(
        {Quaternion(Eigen::AngleAxisd(twist * t, Vector3::UnitX())), start + Vector3(length * t, 0, 0)});
  }
  return shape;
}

/// The square [-1, 1]^2 at z = 0, in 2 n^2 triangles.
TriangleMesh table(int n) {
  TriangleMesh mesh;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) mesh.vertices.emplace_back(-1 + 2.0 * i / n, -1 + 2.0 * j / n, 0);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.faces.push_back({a, b, d});
      mesh.faces.push_back({a, d, c});
    }
  return mesh;
}

/// A rod that is lowered onto a table at z = 0, keeping `last_gap` to it at the end.
Solution loweredRod(int states, int elements = 8, double last_gap = 0.001) {
  Solution solution;
  solution.status = PlanStatus::solved;
  Scenario& scenario = solution.scenario;
  scenario.name = "lowered";
  scenario.summary = "a rod is lowered onto a table";
  scenario.rod.length = 0.8;
  scenario.rod.radius = kRadius;
  scenario.rod.elements = elements;
  scenario.simulation.contact_distance = kContactDistance;
  scenario.environment.meshes.push_back({"table.obj", 1.0, {}});
  for (int k = 0; k < states; ++k) {
    const double height = states > 1 ? 0.3 * (1 - double(k) / (states - 1)) : 0;
    solution.trajectory.time_s.push_back(0.02 * k);
    solution.trajectory.held.push_back({true, k % 2 == 1});
    solution.trajectory.shapes.push_back(
        straightRod({-0.4, 0, kRadius + last_gap + height}, 0.8, elements, 0.3 * k));
  }
  Control down;
  down.end_s = solution.trajectory.time_s.back();
  down.held = {true, true};
  down.moving = End::last;
  down.target = solution.trajectory.shapes.back().back();
  solution.controls.push_back(down);
  return solution;
}

struct Page {
  std::string html;
  std::string text;  // of the data element
  json data;
};

Page writtenPage(const Solution& solution, std::span<const TriangleMesh> meshes, const RodShape& goal = {}) {
  const TemporaryFolder folder;
  writePage(solution, meshes, Obstacles(meshes), goal, folder / "view.html");
  Page page;
  page.html = readFile(folder / "view.html");
  const std::size_t begin = page.html.find(kOpen) + kOpen.size();
  page.text = page.html.substr(begin, page.html.find("</script", begin) - begin);
  page.data = json::parse(page.text);
  return page;
}

std::size_t occurrences(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

/// Base64 by arithmetic on the value of each digit.
template <class Number>
std::vector<Number> decode(const json& encoded) {
  const std::string text = encoded.get<std::string>();
  EXPECT_EQ(text.size() % 4, 0u);
  std::string bytes;
  std::uint32_t bits = 0, count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const int value = c >= 'a'   ? c - 'a' + 26
                      : c >= 'A' ? c - 'A'
                      : c >= '0' ? c - '0' + 52
                      : c == '+' ? 62
                                 : 63;
    bits = bits * 64 + static_cast<std::uint32_t>(value);
    if ((count += 6) < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<char>(bits >> count & 255u));
  }
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
  return numbers;
}

TEST(Page, HoldsEveryStateInSinglePrecisionAndItsFramesToATenThousandthOfARadian) {
  const Solution solution = loweredRod(5);
  const std::array meshes = {table(2)};
  const json data = writtenPage(solution, meshes).data;
  const json& trajectory = data["trajectory"];
  EXPECT_EQ(trajectory["states"], 5);
  EXPECT_EQ(trajectory["nodes"], 9);
  const auto positions = decode<float>(trajectory["positions"]);
  const auto rotations = decode<std::int16_t>(trajectory["rotations"]);
  ASSERT_EQ(positions.size(), 5u * 9 * 3);
  ASSERT_EQ(rotations.size(), 5u * 9 * 4);
  std::size_t p = 0, r = 0;
  for (const RodShape& shape : solution.trajectory.shapes)
    for (const Pose& node : shape) {
      for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(positions[p++], static_cast<float>(node.position[axis]));
      const Quaternion read(rotations[r + 3], rotations[r], rotations[r + 1], rotations[r + 2]);
      r += 4;
      EXPECT_LT(angleBetween(read.normalized(), node.rotation), 1e-4);
    }
  EXPECT_EQ(decode<double>(trajectory["time_s"]), solution.trajectory.time_s);
  EXPECT_EQ(decode<std::uint8_t>(trajectory["held"]), (std::vector<std::uint8_t>{1, 3, 1, 3, 1}));
}

TEST(Page, HoldsTheMeshesAndTheControls) {
  const Solution solution = loweredRod(3);
  const std::array meshes = {table(3)};
  const json data = writtenPage(solution, meshes).data;
  ASSERT_EQ(data["meshes"].size(), 1u);
  EXPECT_EQ(data["meshes"][0]["name"], "table.obj");
  const auto vertices = decode<float>(data["meshes"][0]["vertices"]);
  const auto faces = decode<std::uint32_t>(data["meshes"][0]["faces"]);
  ASSERT_EQ(vertices.size(), 16u * 3);
  ASSERT_EQ(faces.size(), 18u * 3);
  EXPECT_EQ(vertices[3 * 5], static_cast<float>(meshes[0].vertices[5].x()));
  EXPECT_EQ(faces[3 * 17 + 2], static_cast<std::uint32_t>(meshes[0].faces[17][2]));
  ASSERT_EQ(data["controls"].size(), 1u);
  EXPECT_EQ(data["controls"][0]["held"], json({"first", "last"}));
  EXPECT_EQ(data["controls"][0]["moving"], "last");
  EXPECT_EQ(data["controls"][0]["target"], toJson(solution.controls[0].target));
}

TEST(Page, ContactsLieOnTheTableUnderEverySegmentOnceItIsWithinTheContactDistance) {
  const double last_gap = 0.001;
  const Solution solution = loweredRod(31, 8, last_gap);  // 10 mm a state: only the last one is in contact
  const std::array meshes = {table(4)};
  const json data = writtenPage(solution, meshes).data;
  const auto offsets = decode<std::uint32_t>(data["contacts"]["offsets"]);
  const auto points = decode<float>(data["contacts"]["points"]);
  ASSERT_EQ(offsets.size(), 32u);
  EXPECT_EQ(offsets[30], 0u);
  ASSERT_GE(offsets[31], 4u);
  ASSERT_LE(offsets[31], 8u);
  ASSERT_EQ(points.size(), 3u * offsets[31]);
  for (std::size_t i = 0; i < points.size(); i += 3) {
    EXPECT_GE(points[i], -0.4f - 1e-6f);
    EXPECT_LE(points[i], 0.4f + 1e-6f);
    EXPECT_NEAR(points[i + 1], 0, 1e-6);
    EXPECT_NEAR(points[i + 2], 0, 1e-6);
  }
  const auto gaps = decode<float>(data["trajectory"]["gap_m"]);
  ASSERT_EQ(gaps.size(), 31u);
  EXPECT_TRUE(std::isinf(gaps[0]));
  EXPECT_NEAR(gaps[30], last_gap, 1e-8);
  EXPECT_EQ(data["contacts"]["reach_m"], kRadius);
}

TEST(Page, ANameCannotEndTheElementItStandsIn) {
  Solution solution = loweredRod(2);
  const std::string plain = writtenPage(solution, {}).html;
  solution.scenario.name = "</script><script>alert(1)</script>";
  solution.scenario.summary = "<!-- <script> \xff & \"quotes\" \u2028";
  const Page page = writtenPage(solution, {});
  EXPECT_EQ(page.text.find('<'), std::string::npos);
  for (const char* word : {"<script", "</script", "<!--"})
    EXPECT_EQ(occurrences(page.html, word), occurrences(plain, word)) << word;
  EXPECT_EQ(page.data["name"], solution.scenario.name);
  EXPECT_EQ(page.data["summary"], "<!-- <script> \ufffd & \"quotes\" \u2028");
}

TEST(Page, RefersToNoOtherFile) {
  const std::string html = writtenPage(loweredRod(2), {}).html;
  EXPECT_EQ(occurrences(html, kOpen), 1u);
  EXPECT_EQ(occurrences(html, "<link rel=\"stylesheet\""), 0u);
  EXPECT_EQ(occurrences(html, "<script type=\"module\" src"), 0u);
  EXPECT_EQ(occurrences(html, "<script src"), 0u);
}

TEST(Page, SaysHowTheSearchEnded) {
  Solution solution = loweredRod(2);
  for (const PlanStatus status : {PlanStatus::solved, PlanStatus::time_limit, PlanStatus::iteration_limit,
                                  PlanStatus::cancelled, PlanStatus::simulated}) {
    solution.status = status;
    EXPECT_EQ(writtenPage(solution, {}).data["status"], name(status));
  }
}

TEST(Page, GoalShowsItsShapeAndItsGrippers) {
  Solution solution = loweredRod(2);
  EXPECT_TRUE(writtenPage(solution, {}).data["goal"]["shape"].is_null());
  EXPECT_TRUE(writtenPage(solution, {}).data["goal"]["grippers"].empty());

  const RodShape ghost = straightRod({0, 1, 0}, 0.8, 4);
  json goal = writtenPage(solution, {}, ghost).data["goal"];
  EXPECT_EQ(goal["shape"]["nodes"], 5);
  EXPECT_EQ(goal["grippers"], json::array({toJson(ghost.front()), toJson(ghost.back())}));

  GripperPoses ends;
  ends.first.position = {1, 2, 3};
  solution.scenario.goal.emplace().placement = ends;
  goal = writtenPage(solution, {}).data["goal"];
  EXPECT_EQ(goal["grippers"], json::array({toJson(ends.first), toJson(ends.last)}));
}

TEST(Page, OneStateAndNoObstaclesIsAPageToo) {
  const json data = writtenPage(loweredRod(1), {}).data;
  EXPECT_EQ(data["trajectory"]["states"], 1);
  EXPECT_TRUE(data["meshes"].empty());
  EXPECT_EQ(decode<std::uint32_t>(data["contacts"]["offsets"]), (std::vector<std::uint32_t>{0, 0}));
  EXPECT_TRUE(std::isinf(decode<float>(data["trajectory"]["gap_m"]).at(0)));
}

TEST(Page, TwoThousandStatesAmongAHundredThousandFacesStayBelow15Megabytes) {
  const Solution solution = loweredRod(2000, 40);
  const std::array meshes = {table(235)};  // 110,450 faces
  EXPECT_LT(writtenPage(solution, meshes).html.size(), 15'000'000u);
}

TEST(Page, TheSameSolutionGivesTheSameBytes) {
  const Solution solution = loweredRod(20);
  const std::array meshes = {table(4)};
  EXPECT_EQ(writtenPage(solution, meshes).html, writtenPage(solution, meshes).html);
}

TEST(Page, AFolderThatCannotBeMadeIsAnInputError) {
  const TemporaryFolder folder;
  writeFileAtomically(folder / "file", "not a folder");
  EXPECT_THROW(writePage(loweredRod(2), {}, Obstacles(std::span<const TriangleMesh>{}), {},
                         folder / "file" / "view.html"),
               InputError);
}

}  // namespace
}  // namespace tendril
