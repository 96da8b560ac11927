// The pictures of docs/plant are what the plant says today, every effect has one, and a page shows it.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "plant/effects/registry.h"
#include "tests/plant/pictures/picture.h"

namespace imrig::plant::pictures {
namespace {

const std::filesystem::path kDocs = std::filesystem::path(IMRIG_SOURCE_DIR) / "docs";

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// The text without its numbers, and the numbers.
struct Parts {
  std::string words;
  std::vector<double> numbers;
  explicit Parts(const std::string& text) {
    const char* at = text.c_str();
    while (*at) {
      char* end = nullptr;
      const bool starts = (*at >= '0' && *at <= '9') || (*at == '-' && at[1] >= '0' && at[1] <= '9');
      const double value = starts ? std::strtod(at, &end) : 0.0;
      if (starts)
        numbers.push_back(value), words += '#', at = end;
      else
        words += *at++;
    }
  }
};

// Another compiler's last bits move a point by a fraction of a pixel; another plant by more.
TEST(Pictures, AreWhatThePlantSays) {
  std::set<std::string> names;
  for (const Picture& picture : all_pictures()) {
    EXPECT_TRUE(names.insert(picture.name).second) << picture.name;
    const std::string today = svg(picture), file = read(kDocs / "plant/img" / (picture.name + ".svg"));
    const Parts a(today), b(file);
    EXPECT_LT(today.size(), 40'000u) << picture.name;
    ASSERT_EQ(a.words, b.words) << picture.name << ": scripts/plant-pictures draws it anew";
    ASSERT_EQ(a.numbers.size(), b.numbers.size()) << picture.name;
    for (std::size_t k = 0; k < a.numbers.size(); ++k) {
      ASSERT_NEAR(a.numbers[k], b.numbers[k], 0.35)
          << picture.name << ": scripts/plant-pictures draws it anew";
    }
  }
  for (const auto& entry : std::filesystem::directory_iterator(kDocs / "plant/img")) {
    EXPECT_TRUE(names.count(entry.path().stem())) << entry.path() << " is no picture of the plant any more";
  }
  for (const auto& effect : effect_registry()) {
    EXPECT_TRUE(names.count(effect.name)) << effect.name << " has no picture";
  }
}

TEST(Pictures, AndEffectsAreOnThePagesOfTheDocumentation) {
  std::string pages;
  for (const auto& entry : std::filesystem::directory_iterator(kDocs / "plant")) {
    if (entry.path().extension() == ".md") pages += read(entry.path());
  }
  for (const auto& entry : std::filesystem::directory_iterator(kDocs / "plant/img")) {
    EXPECT_NE(pages.find("(img/" + entry.path().filename().string() + ")"), std::string::npos)
        << entry.path();
  }
  const std::string overview = read(kDocs / "plant.md");
  for (const auto& effect : effect_registry()) {
    EXPECT_NE(pages.find("`[effects." + effect.name + "]`"), std::string::npos) << effect.name;
    const auto row = overview.find("\n| `" + effect.name + "`");
    ASSERT_NE(row, std::string::npos) << effect.name << " has no row in docs/plant.md";
    const std::string line = overview.substr(row + 1, overview.find('\n', row + 1) - row - 1);
    EXPECT_NE(line.find("](plant/img/" + effect.name + ".svg)"), std::string::npos) << line;
    EXPECT_NE(line.find(".md)"), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace imrig::plant::pictures
