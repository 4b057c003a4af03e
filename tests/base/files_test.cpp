#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "tendril/base.h"

namespace tendril {
namespace {
namespace fs = std::filesystem;

/// A folder of its own for each test, removed afterwards.
class Files : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::vector<fs::path> entries() const {
    std::vector<fs::path> names;
    for (const auto& entry : fs::directory_iterator(folder_)) names.push_back(entry.path().filename());
    return names;
  }

  fs::path folder_ =
      fs::temp_directory_path() / ("tendril-files-" + std::to_string(::getpid()) + "-" +
                                   testing::UnitTest::GetInstance()->current_test_info()->name());
};

template <class Call>
std::string messageOf(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(Files, WhatIsWrittenIsReadByteForByte) {
  std::string bytes;
  for (int i = 0; i < 100000; ++i) bytes += static_cast<char>(i % 251);
  bytes += std::string("\r\n\0\n", 4);
  for (const std::string& content : {bytes, std::string()}) {
    writeFileAtomically(folder_ / "file", content);
    EXPECT_EQ(readFile(folder_ / "file"), content);
  }
}

TEST_F(Files, WritingMakesTheFolderAndLeavesNothingElseBehind) {
  writeFileAtomically(folder_ / "a" / "b" / "file", "one");
  EXPECT_EQ(readFile(folder_ / "a" / "b" / "file"), "one");
  writeFileAtomically(folder_ / "file", "one");
  writeFileAtomically(folder_ / "file", "two");
  EXPECT_EQ(readFile(folder_ / "file"), "two");
  EXPECT_EQ(entries().size(), 2u) << "the folder a, and the file";
}

TEST_F(Files, AReaderSeesTheOldFileOrTheNewOneNeverAPart) {
  const std::string one(300000, '1'), two(200000, '2');
  const fs::path file = folder_ / "file";
  writeFileAtomically(file, one);
  std::atomic<bool> done = false;
  std::jthread writer([&] {
    for (int i = 0; i < 50; ++i) writeFileAtomically(file, i % 2 == 0 ? two : one);
    done = true;
  });
  while (!done) {
    const std::string seen = readFile(file);
    ASSERT_TRUE(seen == one || seen == two) << seen.size();
  }
}

TEST_F(Files, AFailedWriteSaysWhereAndLeavesNothingBehind) {
  fs::create_directories(folder_ / "taken" / "inside");  // a folder that is not empty cannot be replaced
  const std::string replaced = messageOf([&] { writeFileAtomically(folder_ / "taken", "x"); });
  EXPECT_TRUE(replaced.starts_with((folder_ / "taken").string() + ": cannot be written: ")) << replaced;
  EXPECT_EQ(entries().size(), 1u);

  writeFileAtomically(folder_ / "file", "x");
  const std::string below = messageOf([&] { writeFileAtomically(folder_ / "file" / "below", "x"); });
  EXPECT_TRUE(below.starts_with((folder_ / "file").string() + ": ")) << below;
  EXPECT_EQ(readFile(folder_ / "file"), "x");
}

TEST_F(Files, ReadingSaysWhatIsWrong) {
  EXPECT_EQ(messageOf([&] { static_cast<void>(readFile(folder_ / "none")); }),
            (folder_ / "none").string() + ": no such file.");
  EXPECT_EQ(messageOf([&] { static_cast<void>(readFile(folder_)); }),
            folder_.string() + ": is a folder; name a file.");
}

TEST(Sha256, EqualsThePublishedVectors) {
  // FIPS 180-2, appendix B, and the empty message.
  EXPECT_EQ(sha256Hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256Hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256Hex(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(NearestWord, FindsTheWordThatWasMeant) {
  const std::vector<std::string> words = {"grippers", "environment", "simulation", "goal", "rod"};
  EXPECT_EQ(nearestWord("gripers", words), "grippers");
  EXPECT_EQ(nearestWord("enviroment", words), "environment");
  EXPECT_EQ(nearestWord("gaol", words), "goal");
  EXPECT_EQ(nearestWord("goal", words), "goal");
}

TEST(NearestWord, SaysNothingWhenNothingIsNear) {
  EXPECT_EQ(nearestWord("colour", {"grippers", "environment", "goal"}), "");
  EXPECT_EQ(nearestWord("x", {}), "");
}

}  // namespace
}  // namespace tendril
