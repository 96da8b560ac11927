// Drives a LLVMFuzzerTestOneInput without libFuzzer: seeded random buffers and mutations of the corpus the target offers.
// The same count gives the same inputs; a crash or a sanitizer report is the failure.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
// Well-formed inputs to mutate; may be empty.
std::vector<std::vector<std::uint8_t>> fuzz_corpus();

int main(int argc, char** argv) {
  const long runs = argc > 1 ? std::strtol(argv[1], nullptr, 10) : 20000;
  const auto corpus = fuzz_corpus();
  for (const auto& seed : corpus) LLVMFuzzerTestOneInput(seed.data(), seed.size());
  std::mt19937_64 random(12345);
  for (long run = 0; run < runs; ++run) {
    std::vector<std::uint8_t> bytes;
    if (!corpus.empty() && random() % 4 != 0) {
      bytes = corpus[random() % corpus.size()];
      const std::size_t edits = 1 + random() % 8;
      for (std::size_t k = 0; k < edits && !bytes.empty(); ++k) {
        static constexpr std::uint8_t kOdd[] = {0x00, 0x01, 0x7f, 0x80, 0xff};
        const std::size_t at = random() % bytes.size();
        switch (random() % 4) {
          case 0: bytes[at] = static_cast<std::uint8_t>(random()); break;
          case 1: bytes[at] = kOdd[random() % 5]; break;
          case 2: bytes.resize(at); break;
          default: bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), static_cast<std::uint8_t>(random()));
        }
      }
    } else {
      bytes.resize(random() % 300);
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    }
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  std::printf("%ld inputs, %zu of them from the corpus' seeds\n", runs, corpus.size());
  return 0;
}
