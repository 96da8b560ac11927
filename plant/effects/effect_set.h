#pragma once
// The effects of one plant sorted by hook, so that the derivative visits only those that have something to
// say.

#include <cstddef>
#include <memory>
#include <vector>

#include "plant/effects/effect.h"

namespace imrig::plant {

class EffectSet {
 public:
  struct Slot {
    const Effect* effect;
    std::size_t offset;  // of its states
  };

  explicit EffectSet(const std::vector<std::shared_ptr<const Effect>>& effects) : owned_(effects) {
    for (const auto& effect : owned_) {
      const Slot slot{effect.get(), states_};
      for (std::size_t k = 0; k < kHooks; ++k) {
        if (effect->hooks() & (1u << k)) by_hook_[k].push_back(slot);
      }
      if (!(effect->hooks() & Effect::kStates)) continue;
      (effect->slow() ? slow_ : quick_).push_back(slot);
      if (!effect->slow() && effect->hooks() & Effect::kReadsLosses) quick_reads_losses_ = true;
      states_ += effect->states();
    }
  }

  std::size_t states() const { return states_; }
  const std::vector<Slot>& currents() const { return by_hook_[0]; }
  const std::vector<Slot>& resistances() const { return by_hook_[1]; }
  const std::vector<Slot>& applied_voltage() const { return by_hook_[2]; }
  const std::vector<Slot>& drag() const { return by_hook_[3]; }
  const std::vector<Slot>& with_states() const { return by_hook_[4]; }
  // Those with states, by Effect::slow().
  const std::vector<Slot>& quick() const { return quick_; }
  const std::vector<Slot>& slow() const { return slow_; }
  bool quick_reads_losses() const { return quick_reads_losses_; }
  const std::vector<Slot>& measured() const { return by_hook_[5]; }
  const std::vector<Slot>& temperatures() const { return by_hook_[6]; }
  const std::vector<Slot>& rotor_drop() const { return by_hook_[7]; }
  const std::vector<Slot>& coupling() const { return by_hook_[8]; }
  const std::vector<Slot>& losses() const { return by_hook_[9]; }
  const std::vector<Slot>& energy() const { return by_hook_[10]; }
  const std::vector<Slot>& shunt() const { return by_hook_[11]; }

 private:
  static constexpr std::size_t kHooks = 12;
  std::vector<std::shared_ptr<const Effect>> owned_;
  std::vector<Slot> by_hook_[kHooks];
  std::vector<Slot> quick_, slow_;
  bool quick_reads_losses_ = false;
  std::size_t states_ = 0;
};

}  // namespace imrig::plant
