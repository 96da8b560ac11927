#pragma once
// A folder of its own for each test, gone afterwards; and motors whose measurements are known by
// construction.

#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "rig/base/error.h"
#include "rig/base/space_vector.h"

namespace imrig::test {

class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "imrig_data_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  ~Scratch() { std::filesystem::remove_all(path_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  std::string path(const std::string& name = "") const { return name.empty() ? path_ : path_ + "/" + name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  }

 private:
  std::string path_;
};

// The sentence of the Error that body throws; empty if it throws none.
template <class Body>
std::string complaint(Body&& body) {
  try {
    body();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

inline bool has(const std::vector<std::string>& sentences, const std::string& part) {
  for (const auto& sentence : sentences) {
    if (sentence.find(part) != std::string::npos) return true;
  }
  return false;
}

// A steady motor: 4 poles, 50 Hz, 230 V rms per phase, 10 A peak lagging by 30 degrees, slip 3 %.
struct Bench {
  double f_Hz = 50.0, v_V = 325.0, i_A = 10.0, lag = kPi / 6.0, speed_rpm = 1455.0, sample_time_s = 1e-4;
  int samples = 2000;

  std::string header = "t_s,v_a_V,v_b_V,v_c_V,i_a_A,i_b_A,i_c_A,speed_rpm";
  // Row k as text; a test may change the numbers first.
  std::vector<double> row(int k) const {
    const double t = k * sample_time_s;
    const auto v = phases(std::polar(v_V, 2.0 * kPi * f_Hz * t));
    const auto i = phases(std::polar(i_A, 2.0 * kPi * f_Hz * t - lag));
    return {t, v[0], v[1], v[2], i[0], i[1], i[2], speed_rpm};
  }
  template <class Change>
  std::string csv(Change&& change) const {
    std::string text = header + "\n";
    char cell[40];
    for (int k = 0; k < samples; ++k) {
      std::vector<double> values = row(k);
      if (!change(k, values)) continue;
      for (std::size_t c = 0; c < values.size(); ++c) {
        std::snprintf(cell, sizeof cell, "%s%.17g", c == 0 ? "" : ",", values[c]);
        text += std::isnan(values[c]) ? (c == 0 ? "" : ",") : cell;
      }
      text += '\n';
    }
    return text;
  }
  std::string csv() const {
    return csv([](int, std::vector<double>&) { return true; });
  }
};

inline std::string manifest(const std::string& records, const std::string& connection = "star",
                            const std::string& quantities = "phase") {
  return "name = \"test\"\npole_pairs = 2\nconnection = \"" + connection + "\"\nquantities = \"" +
         quantities + "\"\n" + records;
}

inline const char* const kOneRecord = "[[record]]\nid = \"r1\"\nkind = \"steady\"\nfile = \"r1.csv\"\n";

}  // namespace imrig::test
