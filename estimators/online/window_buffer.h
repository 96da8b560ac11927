#pragma once
// The samples of the window that is being filled: vectors in V and A, unwrapped counts. Space for the longest
// window is taken once.

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

namespace imrig::est {

class WindowBuffer {
 public:
  void reserve(std::size_t most) {
    clear();
    v_.reserve(most);
    i_.reserve(most);
    counts_.reserve(most);
  }
  void push(std::complex<double> v, std::complex<double> i, std::int32_t count) {
    // The counter wraps at 2^32; between two samples it moves by less than half of that.
    const std::int64_t unwrapped =
        counts_.empty()
            ? count
            : counts_.back() + static_cast<std::int32_t>(static_cast<std::uint32_t>(count) -
                                                         static_cast<std::uint32_t>(counts_.back()));
    v_.push_back(v);
    i_.push_back(i);
    counts_.push_back(unwrapped);
  }
  void clear() { drop(size()); }
  // Forgets the first n samples.
  void drop(std::size_t n) {
    const auto from = static_cast<std::ptrdiff_t>(n);
    v_.erase(v_.begin(), v_.begin() + from);
    i_.erase(i_.begin(), i_.begin() + from);
    counts_.erase(counts_.begin(), counts_.begin() + from);
  }
  std::size_t size() const { return v_.size(); }
  std::span<const std::complex<double>> v() const { return v_; }
  std::span<const std::complex<double>> i() const { return i_; }
  std::span<const std::int64_t> counts() const { return counts_; }

 private:
  std::vector<std::complex<double>> v_, i_;
  std::vector<std::int64_t> counts_;
};

}  // namespace imrig::est
