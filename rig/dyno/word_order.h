#pragma once
// 32-bit values in two Modbus registers. A is the value's highest byte, D its lowest; a register travels high
// byte first. ABCD puts AB into the first register and CD into the second; CDAB swaps the registers; BADC
// swaps the bytes in each; DCBA does both. libmodbus 3.1.6 has functions of these names that do not give back
// what they were given; nothing here uses them.

#include <array>
#include <cstdint>

namespace imrig {

enum class WordOrder { kABCD, kCDAB, kBADC, kDCBA };

using WordPair = std::array<std::uint16_t, 2>;  // in the order of their addresses

WordPair words_of(std::uint32_t value, WordOrder order);
std::uint32_t value_of(WordPair words, WordOrder order);

}  // namespace imrig
