// imrig-plant-pictures FOLDER: writes every picture of docs/plant as FOLDER/NAME.svg.

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "rig/base/error.h"
#include "tests/plant/pictures/picture.h"

namespace {

int write_all(int argc, char** argv) {
  if (argc != 2)
    throw imrig::Error("imrig-plant-pictures", "takes one folder", "imrig-plant-pictures docs/plant/img");
  const std::filesystem::path folder(argv[1]);
  std::filesystem::create_directories(folder);
  for (const auto& picture : imrig::plant::pictures::all_pictures()) {
    const auto path = folder / (picture.name + ".svg");
    std::ofstream file(path);
    file << imrig::plant::pictures::svg(picture);
    if (!file.flush()) throw imrig::Error(path.string(), "cannot be written");
    std::printf("%s\n", path.c_str());
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) { return imrig::run_main("imrig-plant-pictures", write_all, argc, argv); }
