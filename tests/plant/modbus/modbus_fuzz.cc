// Any bytes as a request's protocol data unit: whatever they are, the register file stays within its ratings.
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "plant/modbus_registers.h"

std::vector<std::vector<std::uint8_t>> fuzz_corpus() {
  return {{3, 0, 8, 0, 11},
          {6, 0, 8, 4, 210},
          {16, 0, 8, 0, 2, 4, 4, 210, 9, 41},
          {16, 0, 82, 0, 2, 4, 11, 184, 9, 196}};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace imrig::plant;
  static RidenRegisters registers{RidenRatings{}};
  const ModbusRequest request = read_request({data, size});
  if (request.exception == ModbusException::kNone && (request.count < 1 || request.count > 125)) std::abort();
  registers.carry_out(request);
  const ExcitationCommand command = registers.command();
  if (command.set_V > 60.0 || command.set_A > 6.0 || registers.words()[0] != 60062) std::abort();
  return 0;
}
