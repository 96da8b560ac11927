#include "rig/campaign/journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>

#include "rig/base/error.h"
#include "rig/base/file.h"

namespace imrig {
namespace {

using ::testing::HasSubstr;

class JournalTest : public ::testing::Test {
 protected:
  JournalTest() {
    // Every line is flushed to disk, thousands of them here: in memory where there is such a place.
    const bool memory = std::filesystem::is_directory("/dev/shm");
    folder_ = ((memory ? std::filesystem::path("/dev/shm") : std::filesystem::temp_directory_path()) /
               "imrig-journal-XXXXXX")
                  .string();
    if (::mkdtemp(folder_.data()) == nullptr) throw std::runtime_error("no temporary folder");
  }
  ~JournalTest() override { std::filesystem::remove_all(folder_); }

  std::string complaint() const {
    try {
      read_journal(folder_);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

  std::string folder_;
  JournalIdentity identity_ = {"quick", 0x1234567890abcdefull, 7, 0, 5};
};

TEST_F(JournalTest, SaysWhatWasDone) {
  {
    Journal j = Journal::begin(folder_, identity_);
    j.record_begun("a", 1);
    j.point_done({"a", 1, 0, 100});
    j.record_begun("b", 2);
    j.point_retried("b", 1, "5 of 100 samples are missing");
    j.record_begun("b", 3);
    j.point_done({"b", 3, 0, 100});
    j.point_failed("c", "stalled");
    j.ended("stopped", "by the operator");
  }
  const JournalState state = read_journal(folder_);
  EXPECT_TRUE(state.began);
  EXPECT_FALSE(state.torn);
  EXPECT_EQ(state.identity.plan, "quick");
  EXPECT_EQ(state.identity.plan_hash, 0x1234567890abcdefull);
  ASSERT_EQ(state.done.size(), 2u);
  EXPECT_EQ(state.done[1].id, "b");
  EXPECT_EQ(state.done[1].number, 3);
  EXPECT_EQ(state.highest_number, 3);
}

TEST_F(JournalTest, TornAtAnyByteKeepsEveryWholeLineAndGoesOn) {
  std::vector<std::size_t> ends;  // file size after each point's line
  {
    Journal j = Journal::begin(folder_, identity_);
    for (int k = 1; k <= 4; ++k) {
      j.record_begun("p" + std::to_string(k), k);
      j.point_done({"p" + std::to_string(k), k, 0, 10 * k});
      ends.push_back(std::filesystem::file_size(journal_path(folder_)));
    }
  }
  const std::string whole = read_text(journal_path(folder_));
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    write_text_atomically(journal_path(folder_), whole.substr(0, cut));
    const JournalState state = read_journal(folder_);
    const auto expected = static_cast<std::size_t>(
        std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= cut; }));
    ASSERT_EQ(state.done.size(), expected) << "cut at " << cut;
    if (!state.began) {
      EXPECT_LT(cut, whole.find('\n') + 1);
      continue;
    }
    {
      Journal j = Journal::resume(folder_, state, 1);
      EXPECT_EQ(j.part(), 1);
      j.point_done({"new", 9, j.part(), 1});
    }
    const JournalState after = read_journal(folder_);
    EXPECT_FALSE(after.torn);
    ASSERT_EQ(after.done.size(), expected + 1) << "cut at " << cut;
    EXPECT_EQ(after.done.back().id, "new");
    EXPECT_EQ(after.done.back().part, 1);
  }
}

TEST_F(JournalTest, WithdrawnPointIsNotDone) {
  {
    Journal j = Journal::begin(folder_, identity_);
    j.point_done({"a", 1, 0, 100});
    j.point_withdrawn("a", "its record is not whole in the log");
  }
  EXPECT_TRUE(read_journal(folder_).done.empty());
}

TEST_F(JournalTest, PointDoneTwiceCountsOnce) {
  {
    Journal j = Journal::begin(folder_, identity_);
    j.point_done({"a", 1, 0, 100});
    j.point_done({"a", 4, 0, 100}, true);
  }
  const JournalState state = read_journal(folder_);
  ASSERT_EQ(state.done.size(), 1u);
  EXPECT_EQ(state.done[0].number, 4);
}

TEST_F(JournalTest, SecondBeginIsRefused) {
  Journal::begin(folder_, identity_);
  EXPECT_THROW(Journal::begin(folder_, identity_), Error);
}

TEST_F(JournalTest, BadLineInTheMiddleIsToldWithItsNumber) {
  { Journal j = Journal::begin(folder_, identity_); }
  const std::string good = read_text(journal_path(folder_));
  for (const char* bad : {"garbage", "{}", "{\"event\": 3}", "{\"event\":\"point\",\"id\":\"a\"}", "[1]",
                          "null", "", "{\"event\":\"start\",\"version\":1}"}) {
    write_text_atomically(journal_path(folder_), good + bad + "\n" + "{\"event\":\"resume\",\"part\":1}\n");
    EXPECT_THAT(complaint(), HasSubstr("journal.jsonl:2")) << bad;
  }
  write_text_atomically(journal_path(folder_), "{\"event\":\"resume\",\"part\":1}\n" + good);
  EXPECT_THAT(complaint(), HasSubstr("journal.jsonl:1"));
}

TEST_F(JournalTest, ChangedPlanRigOrPlantIsToldByName) {
  const auto told = [&](JournalIdentity now) -> std::string {
    try {
      require_same(identity_, now, "DIR");
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(told(identity_), "");
  JournalIdentity now = identity_;
  now.plan_hash = 1;
  EXPECT_THAT(told(now), HasSubstr("the plan has changed"));
  now = identity_;
  now.rig_hash = 1;
  EXPECT_THAT(told(now), HasSubstr("the rig's configuration has changed"));
  now = identity_;
  now.plant_hash = 1;
  EXPECT_THAT(told(now), HasSubstr("the plant has changed"));
}

}  // namespace
}  // namespace imrig
