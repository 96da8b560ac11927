// Any bytes: a table whose columns have one length, or an Error; never more cells than allowed.

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "rig/base/error.h"
#include "rig/data/csv.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  try {
    const auto table =
        imrig::parse_csv(text, "fuzz.csv", {.max_bytes = 4096, .max_columns = 8, .max_cells = 256});
    if (table.columns.size() != table.names.size() || table.columns.empty() || table.columns.size() > 8)
      std::abort();
    for (const auto& column : table.columns) {
      if (column.size() != table.lines.size() || column.size() * table.columns.size() > 256) std::abort();
      for (const double x : column) {
        if (std::isinf(x)) std::abort();
      }
    }
  } catch (const imrig::Error& e) {
    if (std::string(e.what()).find("fuzz.csv") != 0) std::abort();
  }
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_corpus() {
  std::vector<std::vector<std::uint8_t>> all;
  for (const std::string text : {"a,b\n1,2\n3,4\n",
                                 "\xef\xbb\xbf"
                                 "a;b;c\r\n1,5;;2\r\n\"3\";NaN;-1e5\r\n",
                                 "# x\n\"a,\"\"b\"\t c\n1\t2,5\n\n", "x\n1,5\n"}) {
    all.emplace_back(text.begin(), text.end());
  }
  return all;
}
