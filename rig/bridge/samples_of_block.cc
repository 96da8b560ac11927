#include "rig/bridge/samples_of_block.h"

namespace imrig {

imrig_msg::samples_t samples_of_block(const imrig_block& block, const imrig_welcome& welcome) {
  imrig_msg::samples_t out;
  out.utime = block.first_index * welcome.sample_time_ns / 1000;
  out.seq = block.seq;
  out.samples_v1 = 1;
  out.boot_id = welcome.boot_id;
  out.first_index = block.first_index;
  out.sample_time_ns = welcome.sample_time_ns;
  out.segment = block.segment;
  out.profile_id = block.profile_id;
  out.record = block.record;
  out.gates_on = block.gates_on;
  out.current_A_per_count = welcome.current_A_per_count;
  out.voltage_V_per_count = welcome.voltage_V_per_count;
  out.voltage_filter_s = welcome.voltage_filter_s;
  out.full_scale_counts = welcome.full_scale_counts;
  out.encoder_counts_per_rev = welcome.encoder_counts_per_rev;
  out.stator_C = block.stator_C;
  out.n = block.n;
  out.i_a.assign(block.i_a, block.i_a + block.n);
  out.i_b.assign(block.i_b, block.i_b + block.n);
  out.i_c.assign(block.i_c, block.i_c + block.n);
  out.v_a.assign(block.v_a, block.v_a + block.n);
  out.v_b.assign(block.v_b, block.v_b + block.n);
  out.v_c.assign(block.v_c, block.v_c + block.n);
  out.encoder.assign(block.encoder, block.encoder + block.n);
  return out;
}

}  // namespace imrig
